#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/recording/comparison.h"

namespace weft::client {
namespace {

struct DiffOptions {
  std::string a;
  std::string b;
  std::string frames;
  std::optional<double> within_m;
};

std::string length_text(double meters) { return number_text(meters) + " m"; }

std::string place_text(const Comparison& found) {
  return found.place ? fmt::format("row {}, column {}", found.place->row, found.place->column)
                     : fmt::format("particle {}", found.particle);
}

std::string range_text(const RecordingReader& recording) {
  return fmt::format("{} ({} to {})", recording.path(), recording.first_frame(),
                     recording.last_frame());
}

std::string text(const RecordingReader& a, const RecordingReader& b, const Comparison& found) {
  Facts facts;
  facts.add("frames", fmt::format("{} ({} to {})", found.last_frame - found.first_frame + 1,
                                  found.first_frame, found.last_frame));
  if (!found.same_frames)
    facts.add("not in both", fmt::format("{}, {}", range_text(a), range_text(b)));
  facts.add("rms", length_text(found.rms_m)).add("largest", length_text(found.largest_m));
  if (found.largest_m > 0) {
    facts.add("at", fmt::format("frame {} ({:.6g} s), {}, {}", found.frame, found.time_s,
                                found.sheet, place_text(found)));
  }
  facts.add("bit-equal", found.first_unequal
                             ? fmt::format("no, frame {} is the first", *found.first_unequal)
                         : found.same_frames ? "yes"
                                             : "where both have frames");
  return facts.text();
}

Json json(const Comparison& found) {
  Json largest{{"distance_m", found.largest_m},
               {"frame", found.frame},
               {"time_s", found.time_s},
               {"sheet", found.sheet}};
  if (found.place) {
    largest["row"] = found.place->row;
    largest["column"] = found.place->column;
  } else {
    largest["particle"] = found.particle;
  }
  return {{"first_frame", found.first_frame},
          {"last_frame", found.last_frame},
          {"same_frames", found.same_frames},
          {"rms_m", found.rms_m},
          {"largest", std::move(largest)},
          {"bit_equal", found.bit_equal()},
          {"first_unequal_frame", found.first_unequal ? Json(*found.first_unequal) : Json()}};
}

void check_within(const RecordingReader& a, const RecordingReader& b, const Comparison& found,
                  double within_m) {
  const auto fail = [&](const std::string& why) {
    throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "RECORDINGS_DIFFER",
                  fmt::format("{} and {} differ: {}", a.path(), b.path(), why));
  };
  if (!found.same_frames) fail("one has frames that the other lacks");
  if (found.largest_m > within_m) {
    fail(fmt::format("a particle is {} apart, more than {}", length_text(found.largest_m),
                     length_text(within_m)));
  }
  if (within_m == 0 && !found.bit_equal())
    fail(fmt::format("frame {} is not equal to the bit", *found.first_unequal));
}

void run_diff(Context& context, const DiffOptions& options) {
  RecordingReader a(options.a);
  RecordingReader b(options.b);
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const Comparison found = compare(a, b, read_frame_range(options.frames), [&](std::int64_t frame) {
    status.show({fmt::format("comparing frame {}", frame)});
  });
  status.clear();
  context.answer(json(found), text(a, b, found));
  if (options.within_m) check_within(a, b, found, *options.within_m);
}

}  // namespace

void add_diff(CLI::App& app, Context& context) {
  auto options = std::make_shared<DiffOptions>();
  CLI::App* command = app.add_subcommand("diff", "Say how far two recordings lie apart, and where");
  command->add_option("A", options->a, "Recording")->option_text(" ")->required();
  command->add_option("B", options->b, "Recording of equal sheets and frame step")
      ->option_text(" ")
      ->required();
  command->add_option("--frames", options->frames, "Frames A to B; either may be left out")
      ->option_text("A:B");
  command
      ->add_option("--within", options->within_m,
                   "Fail unless all frames match this closely, m; 0: to the bit")
      ->type_name("M")
      ->check(CLI::NonNegativeNumber);
  command->callback([&context, options] { run_diff(context, *options); });
}

}  // namespace weft::client
