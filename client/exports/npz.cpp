#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string_view>

#include "client/exports/frame_writer.h"
#include "client/exports/output_file.h"
#include "client/problem.h"

namespace weft::client {
namespace {

std::uint32_t crc_of(std::uint32_t before, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// Numbers of a ZIP file, little-endian.
void put(std::string& bytes, std::size_t size, std::uint64_t value) {
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
}

// What stands before the numbers of an array in NumPy's format, version 1.0.
std::string npy_header(std::string_view type, const std::vector<std::size_t>& shape) {
  std::string lengths;
  for (const std::size_t length : shape) lengths += fmt::format("{},", length);
  std::string text =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, lengths);
  constexpr std::size_t kBefore = 10, kAligned = 64;
  text.append(kAligned - (kBefore + text.size() + 1) % kAligned, ' ');
  text += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  put(header, 2, text.size());
  return header + text;
}

// A ZIP file whose files are stored as they are, the arrays of NumPy's savez.
class NpzWriter : public FrameWriter {
 public:
  NpzWriter(const std::string& path, const std::vector<SheetMesh>& sheets, std::size_t frames,
            double frames_per_second)
      : file_(path), frames_(frames) {
    std::vector<std::int32_t> faces, faces_uv, panel;
    std::vector<float> corners;
    std::vector<std::string> names;
    std::size_t particles = 0;
    for (const SheetMesh& sheet : sheets) {
      const auto first = static_cast<std::int32_t>(corners.size() / 2);
      for (const auto& uv : sheet.flat) corners.insert(corners.end(), uv.begin(), uv.end());
      for (const Triangle& triangle : sheet.triangles)
        for (const std::int32_t particle : triangle)
          faces.push_back(sheet.layout.first_particle() + particle);
      for (const Triangle& triangle : sheet.flat_triangles)
        for (const std::int32_t corner : triangle) faces_uv.push_back(first + corner);
      for (const PanelRun& run : sheet.panels) {
        panel.insert(panel.end(), run.count, static_cast<std::int32_t>(names.size()));
        names.push_back(run.name);
      }
      particles += particle_count(sheet.layout);
    }
    add_array("faces", "<i4", {faces.size() / 3, 3}, bytes_of(faces));
    add_array("vertices_uv", "<f4", {corners.size() / 2, 2}, bytes_of(corners));
    add_array("faces_uv", "<i4", {faces_uv.size() / 3, 3}, bytes_of(faces_uv));
    add_array("panel", "<i4", {panel.size()}, bytes_of(panel));
    add_names(names);
    add_array("fps", "<f8", {}, bytes_of(std::vector{frames_per_second}));
    begin_file("vertices_seq", "<f4", {frames, particles, 3}, 12 * frames * particles);
  }

  void add(const ExportFrame& frame) override {
    const auto& [x, y, z] = frame.points;
    std::vector<float> values;
    values.reserve(3 * x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      values.insert(values.end(),
                    {static_cast<float>(x[i]), static_cast<float>(y[i]), static_cast<float>(z[i])});
    }
    write(bytes_of(values));
    for (const auto& [name, of_particles] : frame.values) {
      std::vector<float>& all = values_[name];
      all.insert(all.end(), of_particles.begin(), of_particles.end());
    }
  }

  void finish() override {
    end_file();
    for (const auto& [name, all] : values_)
      add_array(name, "<f4", {frames_, all.size() / frames_}, bytes_of(all));
    const std::size_t end = written_;
    for (const Entry& entry : entries_) write(directory_entry(entry));
    std::string tail("PK\x05\x06\0\0\0\0", 8);
    for (int i = 0; i < 2; ++i) put(tail, 2, entries_.size());
    put(tail, 4, written_ - end);
    put(tail, 4, end);
    put(tail, 2, 0);
    file_.write(tail);
    file_.close();
  }

  static void check(std::size_t particles, std::size_t frames) {
    if (20 * particles * frames <= std::numeric_limits<std::uint32_t>::max() / 2) return;
    throw usage_problem(
        fmt::format("{} frames of {} particles are too much for npz, which takes 2 GiB: choose "
                    "with --frames or --every",
                    frames, particles));
  }

 private:
  struct Entry {
    std::string name;
    std::size_t place = 0;  // in the file
    std::uint32_t checksum = 0;
    std::size_t size = 0;
  };

  // What is said of a file before it, and again at the end: version 2.0, stored, 1 January 1980.
  static std::string facts_of(const Entry& entry) {
    std::string bytes;
    for (const std::uint64_t value : {20U, 0U, 0U, 0U, 33U}) put(bytes, 2, value);
    put(bytes, 4, entry.checksum);
    put(bytes, 4, entry.size);
    put(bytes, 4, entry.size);
    put(bytes, 2, entry.name.size());
    put(bytes, 2, 0);
    return bytes;
  }
  static std::string local_entry(const Entry& entry) {
    return "PK\x03\x04" + facts_of(entry) + entry.name;
  }
  static std::string directory_entry(const Entry& entry) {
    std::string bytes = "PK\x01\x02";
    put(bytes, 2, 20);
    bytes += facts_of(entry);
    put(bytes, 6, 0);  // no comment, the first disk, no text
    put(bytes, 4, 0);
    put(bytes, 4, entry.place);
    return bytes + entry.name;
  }

  void write(std::string_view bytes) {
    file_.write(bytes);
    written_ += bytes.size();
    checksum_ = crc_of(checksum_, bytes);
  }

  void begin_file(const std::string& name, std::string_view type,
                  const std::vector<std::size_t>& shape, std::size_t bytes) {
    const std::string header = npy_header(type, shape);
    entries_.push_back({name + ".npy", written_, 0, header.size() + bytes});
    write(local_entry(entries_.back()));
    checksum_ = 0;
    write(header);
  }
  // The checksum is known only now.
  void end_file() {
    entries_.back().checksum = checksum_;
    file_.seek(static_cast<std::streamoff>(entries_.back().place));
    file_.write(local_entry(entries_.back()));
    file_.seek(static_cast<std::streamoff>(written_));
  }

  void add_array(const std::string& name, std::string_view type,
                 const std::vector<std::size_t>& shape, std::string_view bytes) {
    begin_file(name, type, shape, bytes.size());
    write(bytes);
    end_file();
  }

  // Letters of 32 bits, as many for each name.
  void add_names(const std::vector<std::string>& names) {
    std::size_t longest = 1;
    for (const std::string& name : names) longest = std::max(longest, name.size());
    std::string letters;
    for (const std::string& name : names)
      for (std::size_t i = 0; i < longest; ++i)
        put(letters, 4, i < name.size() ? static_cast<unsigned char>(name[i]) : 0);
    add_array("panel_names", fmt::format("<U{}", longest), {names.size()}, letters);
  }

  OutputFile file_;
  std::size_t frames_;
  std::map<std::string, std::vector<float>> values_;  // of all frames, which come last
  std::vector<Entry> entries_;
  std::size_t written_ = 0;
  std::uint32_t checksum_ = 0;  // of the file that is written
};

}  // namespace

std::unique_ptr<FrameWriter> make_npz_writer(const std::string& path,
                                             const std::vector<SheetMesh>& sheets,
                                             std::size_t frames, double frames_per_second) {
  std::size_t particles = 0;
  for (const SheetMesh& sheet : sheets) particles += particle_count(sheet.layout);
  NpzWriter::check(particles, frames);
  return std::make_unique<NpzWriter>(path, sheets, frames, frames_per_second);
}

}  // namespace weft::client
