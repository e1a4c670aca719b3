#include "client/imports/obj.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <istream>
#include <locale>
#include <map>
#include <sstream>
#include <streambuf>

#include "client/imports/polygon.h"

#define TINYOBJLOADER_USE_DOUBLE
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

namespace weft::client {
namespace {

// Gives a text line by line, and knows which.
class Lines : public std::streambuf {
 public:
  explicit Lines(const std::string& text) : text_(text) {}
  int number() const { return number_; }  // from 1
  std::string_view line() const { return {eback(), static_cast<std::size_t>(egptr() - eback())}; }

 protected:
  int_type underflow() override {
    if (next_ >= text_.size()) return traits_type::eof();
    const std::size_t end = std::min(text_.find('\n', next_), text_.size() - 1) + 1;
    char* data = const_cast<char*>(text_.data());  // get areas are never written to
    setg(data + next_, data + next_, data + end);
    next_ = end;
    ++number_;
    return traits_type::to_int_type(*gptr());
  }

 private:
  const std::string& text_;
  std::size_t next_ = 0;
  int number_ = 0;
};

// Whether that many finite numbers follow the first word. The parser takes others as 0.
bool has_numbers(std::string_view line, int count) {
  constexpr std::string_view kSpace = " \t\r\n";
  std::size_t at = line.find_first_not_of(kSpace);
  for (int i = 0; i < count; ++i) {
    at = line.find_first_not_of(kSpace, std::min(line.find_first_of(kSpace, at), line.size()));
    if (at == std::string_view::npos) return false;
    std::string_view word = line.substr(at, line.find_first_of(kSpace, at) - at);
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      return false;
  }
  return true;
}

struct Face {
  int group, material, object;  // of `names`
};

class Reading {
 public:
  explicit Reading(const std::string& text) : lines_(text) {}

  ImportedMesh run(const std::string& path) {
    tinyobj::callback_t callback;
    callback.vertex_cb = [](void* self, double x, double y, double z, double) {
      static_cast<Reading*>(self)->add_vertex({x, y, z});
    };
    callback.texcoord_cb = [](void* self, double u, double v, double) {
      static_cast<Reading*>(self)->add_flat({u, v});
    };
    callback.index_cb = [](void* self, tinyobj::index_t* indices, int count) {
      static_cast<Reading*>(self)->add_face({indices, indices + count});
    };
    callback.usemtl_cb = [](void* self, const char* name, int) {
      auto* reading = static_cast<Reading*>(self);
      reading->now_.material = reading->number_of(name);
    };
    callback.group_cb = [](void* self, const char** names, int count) {
      auto* reading = static_cast<Reading*>(self);
      reading->now_.group =
          reading->number_of(fmt::format("{}", fmt::join(names, names + count, "_")));
    };
    callback.object_cb = [](void* self, const char* name) {
      auto* reading = static_cast<Reading*>(self);
      reading->now_.object = reading->number_of(name);
    };
    std::istream stream(&lines_);
    tinyobj::LoadObjWithCallback(stream, callback, this);
    std::vector<Fault> faults;
    add_some(faults, bad_numbers_);
    add_some(faults, bad_faces_);
    if (!faults.empty()) throw mesh_problem(path, faults);
    if (mesh_.positions.empty() && faces_.empty())
      throw malformed(path, "is no OBJ file: no line begins with v or f");
    if (faces_.empty()) throw malformed(path, "has points, but no faces (lines that begin with f)");
    name_panels();
    return std::move(mesh_);
  }

 private:
  void add_vertex(const Vector3d& position) {
    require_numbers(3, "x, y and z");
    mesh_.positions.push_back(position);
  }

  void add_flat(const Vector2d& flat) {
    require_numbers(2, "u and v");
    mesh_.flat.push_back(flat);
  }

  void require_numbers(int count, const char* which) {
    if (!has_numbers(lines_.line(), count))
      bad_numbers_.push_back({fmt::format("line {}", lines_.number()),
                              fmt::format("{} are not {} finite numbers", which, count)});
  }

  // One that counts from 1, or from the end where it is negative, as one that counts from 0.
  int index(int given, std::size_t count, const char* what) {
    const auto size = static_cast<std::int64_t>(count);
    const std::int64_t found = given > 0 ? given - 1 : size + given;
    if (given != 0 && found >= 0 && found < size) return static_cast<int>(found);
    refuse(fmt::format("{} {} is not one of the {} before it", what, given, size));
    return 0;
  }

  void refuse(const std::string& why) {
    bad_faces_.push_back({fmt::format("line {} (face {})", lines_.number(), faces_.size()), why});
  }

  void add_face(const std::vector<tinyobj::index_t>& given) {
    faces_.push_back(now_);
    if (given.size() < 3 || given.size() > kMostCorners)
      return refuse(fmt::format("has {} corners, not 3 to {}", given.size(), kMostCorners));
    std::vector<Vector3d> around;
    std::vector<int> particles, corners;
    const std::size_t faults = bad_faces_.size();
    for (const tinyobj::index_t& each : given) {
      const int particle = index(each.vertex_index, mesh_.positions.size(), "vertex");
      particles.push_back(particle);
      corners.push_back(each.texcoord_index == 0
                            ? kNoCorner
                            : index(each.texcoord_index, mesh_.flat.size(), "vt"));
      if (bad_faces_.size() > faults) return;
      around.push_back(mesh_.positions[static_cast<std::size_t>(particle)]);
    }
    const auto pick = [](const std::vector<int>& of, const std::array<int, 3>& which) {
      return std::array{of[static_cast<std::size_t>(which[0])],
                        of[static_cast<std::size_t>(which[1])],
                        of[static_cast<std::size_t>(which[2])]};
    };
    for (const auto& triangle : cut_polygon(around)) {
      mesh_.triangles.push_back(pick(particles, triangle));
      mesh_.corners.push_back(pick(corners, triangle));
      mesh_.source.push_back({0, static_cast<int>(faces_.size()), lines_.number()});
    }
  }

  int number_of(std::string name) {
    name.erase(name.find_last_not_of(" \t\r") + 1);
    const auto [found, added] = numbers_.try_emplace(name, static_cast<int>(names_.size()));
    if (added) names_.push_back(name);
    return found->second;
  }

  // By the first of g, usemtl and o that tells faces apart.
  void name_panels() {
    int Face::*by = nullptr;
    for (const auto& kind : {std::pair(&Face::group, "g"), std::pair(&Face::material, "usemtl"),
                             std::pair(&Face::object, "o")}) {
      const auto differs = [&](const Face& face) {
        return face.*kind.first != faces_[0].*kind.first;
      };
      if (by != nullptr || std::none_of(faces_.begin(), faces_.end(), differs)) continue;
      by = kind.first;
      mesh_.panels_by = kind.second;
    }
    // one panel has the first name that there is
    const Face& first = faces_[0];
    const int only = first.group != 0      ? first.group
                     : first.material != 0 ? first.material
                                           : first.object;
    std::vector<int> panel_of(names_.size(), -1);
    for (const auto& source : mesh_.source) {
      const int name = by == nullptr ? only : faces_[as_index(source.face) - 1].*by;
      int& panel = panel_of[as_index(name)];
      if (panel < 0) panel = add_panel(mesh_, names_[as_index(name)]);
      mesh_.panel.push_back(panel);
    }
  }

  Lines lines_;
  ImportedMesh mesh_;
  std::vector<std::string> names_{""};
  std::map<std::string, int> numbers_{{"", 0}};
  Face now_{0, 0, 0};
  std::vector<Face> faces_;
  std::vector<Fault> bad_numbers_, bad_faces_;
};

// "stitch POINT FIRST SECOND SHARE"
void read_stitches(const std::string& path, const std::string& text, ImportedMesh& mesh) {
  constexpr std::string_view kWord = "stitch ";
  std::vector<Fault> faults;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (!line.starts_with(kWord)) continue;
    std::istringstream words(line.substr(kWord.size()));
    words.imbue(std::locale::classic());
    ImportedMesh::Stitch stitch{};
    words >> stitch.point >> stitch.first >> stitch.second >> stitch.share;
    const auto count = static_cast<int>(mesh.positions.size());
    const auto known = [&](int i) { return i >= 0 && i < count; };
    if (words.fail() || !known(stitch.point) || !known(stitch.first) || !known(stitch.second) ||
        !(stitch.share >= 0 && stitch.share <= 1))
      faults.push_back(
          {fmt::format("line {}", number),
           fmt::format("a stitch has three points of 0 to {} and a share of 0 to 1", count - 1)});
    mesh.stitches.push_back(stitch);
  }
  std::vector<Fault> shown;
  add_some(shown, faults);
  if (!shown.empty()) throw mesh_problem(path, shown);
}

}  // namespace

ImportedMesh read_obj(const std::string& path, const std::string& text) {
  ImportedMesh mesh = Reading(text).run(path);
  read_stitches(path, text, mesh);
  return mesh;
}

}  // namespace weft::client
