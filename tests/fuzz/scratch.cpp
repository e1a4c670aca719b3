#include "tests/fuzz/scratch.h"

#include <filesystem>
#include <fstream>

#include "client/exports/export.h"
#include "client/problem.h"
#include "client/recording/inspection.h"
#include "client/recording/reader.h"

namespace weft {

void Scratch::write(std::string_view bytes) const {
  std::filesystem::remove(file() + "-journal");
  std::ofstream(file(), std::ios::binary).write(bytes.data(), static_cast<long>(bytes.size()));
}

void Scratch::use() const {
  using client::ExportFormat;
  try {
    client::RecordingReader recording(file());
    client::inspect(recording, [](std::int64_t) {});
    for (const auto& [format, name] :
         {std::pair(ExportFormat::kObj, "obj"), std::pair(ExportFormat::kPc2, "a.pc2"),
          std::pair(ExportFormat::kMdd, "a.mdd"), std::pair(ExportFormat::kGltf, "a.glb"),
          std::pair(ExportFormat::kVtk, "a.pvd"), std::pair(ExportFormat::kCsv, "a.csv")}) {
      try {
        client::export_recording(recording, {.format = format, .path = directory_.path(name)},
                                 [](const auto&) {});
      } catch (const client::Problem&) {
        continue;
      }
    }
  } catch (const client::Problem&) {
    return;
  }
}

}  // namespace weft
