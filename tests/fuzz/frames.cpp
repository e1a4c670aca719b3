#include <fuzzer/FuzzedDataProvider.h>

#include <cstdint>

#include "client/problem.h"
#include "client/recording/writer.h"
#include "tests/fuzz/scratch.h"

namespace {

using weft::v1::Frame;
using weft::v1::StreamHeader;

// Mostly small, as sheets are that fit into an input.
std::int32_t some_size(FuzzedDataProvider& input) {
  return input.ConsumeBool() ? input.ConsumeIntegralInRange(0, 5)
                             : input.ConsumeIntegral<std::int32_t>();
}

StreamHeader some_header(FuzzedDataProvider& input) {
  StreamHeader header;
  header.set_uid("uid");
  header.set_start_frame(input.ConsumeBool() ? 0 : input.ConsumeIntegral<std::int64_t>());
  header.set_frame_step_s(input.ConsumeFloatingPoint<double>());
  header.mutable_format()->set_encoding(
      static_cast<weft::v1::FrameEncoding>(input.ConsumeIntegralInRange(-1, 3)));
  header.mutable_format()->set_velocities(input.ConsumeBool());
  std::int32_t particles = 0;
  for (int sheets = input.ConsumeIntegralInRange(0, 3); sheets > 0; --sheets) {
    auto* sheet = header.add_sheets();
    sheet->set_name(input.ConsumeBool() ? "sheet" : input.ConsumeRandomLengthString(8));
    sheet->set_first_particle(input.ConsumeBool() ? particles : some_size(input));
    sheet->set_rows(some_size(input));
    sheet->set_columns(some_size(input));
    particles += static_cast<std::int32_t>(std::int64_t{sheet->rows()} * sheet->columns());
  }
  return header;
}

std::string some_array(FuzzedDataProvider& input) {
  const std::size_t values = input.ConsumeIntegralInRange<std::size_t>(0, 80);
  return input.ConsumeBytesAsString(values * (input.ConsumeBool() ? 4 : 8));
}

}  // namespace

// Whatever a server says of its frames is recorded, read and exported, or refused with a Problem.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) try {
  static const weft::Scratch scratch;
  FuzzedDataProvider input(data, size);
  const StreamHeader header = some_header(input);
  {
    weft::client::RecordingWriter writer(scratch.file(), true, {}, header);
    for (int count = 0; input.remaining_bytes() > 0; ++count) {
      Frame frame;
      frame.set_number(input.ConsumeBool() ? count : input.ConsumeIntegral<std::int64_t>());
      frame.set_time_s(input.ConsumeFloatingPoint<double>());
      frame.set_positions_m(some_array(input));
      if (header.format().velocities()) frame.set_velocities_m_per_s(some_array(input));
      writer.add(frame);
    }
  }
  scratch.use();
  return 0;
} catch (const weft::client::Problem&) {
  return 0;
}
