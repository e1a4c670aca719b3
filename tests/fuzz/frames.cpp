#include <fuzzer/FuzzedDataProvider.h>
#include <zstd.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "client/problem.h"
#include "client/recording/points.h"
#include "client/recording/writer.h"
#include "tests/fuzz/scratch.h"

namespace {

using weft::v1::Frame;
using weft::v1::StreamHeader;

// One time in eight anything at all.
bool is_wild(FuzzedDataProvider& input) { return input.ConsumeIntegralInRange(0, 7) == 7; }

std::int32_t some_size(FuzzedDataProvider& input) {
  return is_wild(input) ? input.ConsumeIntegral<std::int32_t>()
                        : input.ConsumeIntegralInRange(1, 4);
}

StreamHeader some_header(FuzzedDataProvider& input) {
  StreamHeader header;
  header.set_uid("uid");
  if (is_wild(input)) header.set_start_frame(input.ConsumeIntegral<std::int64_t>());
  header.set_frame_step_s(is_wild(input) ? input.ConsumeFloatingPoint<double>() : 1.0 / 60);
  header.mutable_format()->set_encoding(static_cast<weft::v1::FrameEncoding>(
      is_wild(input) ? input.ConsumeIntegral<int>() : input.ConsumeIntegralInRange(1, 3)));
  header.mutable_format()->set_grid_step_m(is_wild(input) ? input.ConsumeFloatingPoint<double>()
                                                          : 1e-4);
  header.mutable_format()->set_velocities(input.ConsumeBool());
  header.mutable_format()->set_pressure(input.ConsumeBool());
  std::uint32_t particles = 0;
  for (int sheets = input.ConsumeIntegralInRange(0, 3); sheets > 0; --sheets) {
    auto* sheet = header.add_sheets();
    sheet->set_name(is_wild(input) ? input.ConsumeRandomLengthString(8) : "sheet");
    sheet->set_first_particle(is_wild(input) ? input.ConsumeIntegral<std::int32_t>()
                                             : static_cast<std::int32_t>(particles));
    sheet->set_rows(some_size(input));
    sheet->set_columns(some_size(input));
    particles +=
        static_cast<std::uint32_t>(sheet->rows()) * static_cast<std::uint32_t>(sheet->columns());
  }
  return header;
}

std::string some_array(FuzzedDataProvider& input, const StreamHeader& header,
                       std::size_t planes = 3) {
  std::size_t values = 0;
  for (const auto& sheet : header.sheets())
    values += planes * static_cast<std::uint16_t>(sheet.rows()) *
              static_cast<std::uint16_t>(sheet.columns());
  const bool doubles = header.format().encoding() == weft::v1::FRAME_ENCODING_FLOAT64;
  std::string bytes = input.ConsumeRandomLengthString();
  if (!is_wild(input)) bytes.resize(std::min<std::size_t>(values, 1000) * (doubles ? 8 : 4));
  if (header.format().encoding() != weft::v1::FRAME_ENCODING_QUANTIZED_ZSTD || is_wild(input))
    return bytes;
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  return packed;
}

}  // namespace

// Whatever a server says of its frames is recorded, read and exported, or refused with a Problem.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) try {
  static const weft::Scratch scratch;
  FuzzedDataProvider input(data, size);
  StreamHeader header;
  if (!header.ParseFromString(some_header(input).SerializeAsString())) return 0;  // not UTF-8
  weft::client::particle_count(header);  // whoever takes frames in asks this first
  {
    weft::client::RecordingWriter writer(scratch.file(), true, {}, header);
    for (int count = 0; input.remaining_bytes() > 0; ++count) {
      Frame frame;
      frame.set_number(is_wild(input) ? input.ConsumeIntegral<std::int64_t>() : count);
      frame.set_time_s(is_wild(input) ? input.ConsumeFloatingPoint<double>() : count / 60.0);
      frame.set_positions_m(some_array(input, header));
      if (header.format().velocities()) frame.set_velocities_m_per_s(some_array(input, header));
      if (header.format().pressure()) frame.set_pressure_pa(some_array(input, header, 1));
      writer.add(frame);
    }
  }
  scratch.use();
  return 0;
} catch (const weft::client::Problem&) {
  return 0;
}
