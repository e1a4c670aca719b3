#include "tests/client/mesh_files.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <vector>

namespace weft::testing {
namespace {

constexpr int kSide = 5;

template <class T>
void append(std::string& bytes, T value) {
  char own[sizeof value];
  std::memcpy(own, &value, sizeof value);
  bytes.append(own, sizeof value);
}

std::string corner(int point, const LatticeFile& file) {
  const int number = point + 1 + file.first;
  return file.uv ? fmt::format(" {}/{}", number, number - file.first - kSide * kSide - 1)
                 : fmt::format(" {}", number);
}

void add_cells(std::string& text, const LatticeFile& file, int first_column, int last_column) {
  for (int row = 0; row + 1 < kSide; ++row) {
    for (int column = first_column; column < last_column; ++column) {
      const int i = row * kSide + column;
      text += "f" + corner(i, file) + corner(i + 1, file) + corner(i + kSide + 1, file) + "\nf" +
              corner(i, file) + corner(i + kSide + 1, file) + corner(i + kSide, file) + "\n";
    }
  }
}

}  // namespace

std::string lattice_obj(const LatticeFile& file) {
  std::string points, flat;
  for (int i = 0; i < kSide * kSide; ++i) {
    Eigen::Vector2d at = Eigen::Vector2d(i % kSide, i / kSide) * file.spacing;
    if (file.moved.contains(i)) at = file.moved.at(i);
    points += fmt::format("v {} {} {}\n", at.x(), at.y(), file.z);
    if (file.moved_uv.contains(i)) at = file.moved_uv.at(i);
    flat += fmt::format("vt {} {}\n", file.mirrored ? -at.x() : at.x(), at.y());
  }
  std::string text = points + (file.uv ? flat : "");
  if (file.panels) text += "g left\n";
  add_cells(text, file, 0, kSide / 2);
  if (file.panels) text += "g right\n";
  add_cells(text, file, kSide / 2, kSide - 1);
  return text;
}

std::string tube_obj() {
  constexpr int kAround = 12, kAlong = 3;
  std::string text;
  for (int row = 0; row < kAlong; ++row) {
    for (int i = 0; i <= kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      if (i < kAround)
        text += fmt::format("v {} {} {}\n", std::sin(angle), row / 2.0, std::cos(angle));
      text += fmt::format("vt {} {}\n", angle, row / 2.0);
    }
  }
  for (int row = 0; row + 1 < kAlong; ++row) {
    for (int i = 0; i < kAround; ++i) {
      const auto at = [&](int column, int line) {
        return fmt::format(" {}/{}", line * kAround + column % kAround + 1,
                           line * (kAround + 1) + column + 1);
      };
      text += "f" + at(i, row) + at(i + 1, row) + at(i + 1, row + 1) + at(i, row + 1) + "\n";
    }
  }
  return text;
}

std::string square_glb() {
  // x from 0 to 1, and from 1 to 2: positions, then UV with v downwards, then indices
  std::string data;
  for (const float left : {0.f, 1.f})
    for (const auto& [x, y] : {std::pair(0.f, 0.f), {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
      for (const float value : {left + x, y, 0.f}) append(data, value);
  for (const float left : {0.f, 1.f})
    for (const auto& [x, y] : {std::pair(0.f, 0.f), {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
      for (const float value : {left + x, 1 - y}) append(data, value);
  for (const int i : {0, 1, 2, 0, 2, 3}) append(data, static_cast<std::uint16_t>(i));

  std::string json = fmt::format(
      R"({{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
"nodes": [{{"mesh": 0, "translation": [0, 1, 0]}}],
"materials": [{{"name": "Body"}}, {{"name": "Belt"}}],
"meshes": [{{"name": "square", "primitives": [
  {{"attributes": {{"POSITION": 0, "TEXCOORD_0": 2}}, "indices": 4, "material": 0}},
  {{"attributes": {{"POSITION": 1, "TEXCOORD_0": 3}}, "indices": 4, "material": 1}}]}}],
"accessors": [
  {{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
  {{"bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC3"}},
  {{"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}},
  {{"bufferView": 1, "byteOffset": 32, "componentType": 5126, "count": 4, "type": "VEC2"}},
  {{"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}}],
"bufferViews": [{{"buffer": 0, "byteLength": 96}},
  {{"buffer": 0, "byteOffset": 96, "byteLength": 64}},
  {{"buffer": 0, "byteOffset": 160, "byteLength": 12}}],
"buffers": [{{"byteLength": {}}}]}})",
      data.size());
  json.resize((json.size() + 3) / 4 * 4, ' ');

  std::string file = "glTF";
  append(file, std::uint32_t{2});
  append(file, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + data.size()));
  append(file, static_cast<std::uint32_t>(json.size()));
  file += "JSON" + json;
  append(file, static_cast<std::uint32_t>(data.size()));
  file += std::string("BIN\0", 4) + data;
  return file;
}

}  // namespace weft::testing
