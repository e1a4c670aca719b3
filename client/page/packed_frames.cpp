#include "client/page/packed_frames.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <new>
#include <unordered_map>

namespace weft::client {
namespace {

constexpr std::string_view kBase64 =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::uint32_t zigzag(std::uint32_t difference) {
  return (difference << 1) ^ (difference >> 31 != 0 ? ~0U : 0U);
}

// Four characters for up to three bytes.
std::string base64(std::string_view bytes) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 3; ++i)
    bits = bits << 8 | (i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0U);
  std::string text(4, '=');
  for (std::size_t i = 0; i <= bytes.size(); ++i) text[i] = kBase64[bits >> (18 - 6 * i) & 63];
  return text;
}

// Goes over triangles from neighbour to neighbour.
class Walk {
 public:
  Walk(const std::vector<Triangle>& triangles, const Points& points)
      : triangles_(triangles),
        points_(points),
        count_(static_cast<std::int32_t>(points.x.size())),
        at_(points.x.size()),
        place_(points.x.size(), kNowhere),
        done_(triangles.size()) {
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(triangles.size()); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        at_[corner(t, k)].push_back(t);
        across_[edge(corner(t, k), corner(t, (k + 1) % 3))] = t;
      }
  }

  std::vector<Guess> run() {
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (!done_[t]) walk_from(static_cast<std::int32_t>(t));
    for (std::int32_t i = 0; i < count_; ++i) place(i, {i, count_, count_, count_});
    return std::move(guesses_);
  }

 private:
  static constexpr std::int32_t kNowhere = std::numeric_limits<std::int32_t>::max();

  static std::uint64_t edge(std::size_t from, std::size_t to) {
    return std::uint64_t{from} << 32 | to;
  }

  std::size_t corner(std::int32_t triangle, std::size_t k) const {
    return static_cast<std::size_t>(triangles_[static_cast<std::size_t>(triangle)][k]);
  }

  // The triangle that runs along an edge from one particle to the other, or -1.
  std::int32_t triangle_along(std::size_t from, std::size_t to) const {
    const auto found = across_.find(edge(from, to));
    return found == across_.end() ? -1 : found->second;
  }

  void place(std::int32_t particle, const Guess& guess) {
    std::int32_t& place = place_[static_cast<std::size_t>(particle)];
    if (place != kNowhere) return;
    place = static_cast<std::int32_t>(guesses_.size());
    guesses_.push_back(guess);
  }

  void walk_from(std::int32_t first) {
    std::int32_t before = count_;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto i = static_cast<std::int32_t>(corner(first, k));
      place(i, {i, before, count_, count_});
      before = i;
    }
    std::deque<std::int32_t> reached{first};
    done_[static_cast<std::size_t>(first)] = true;
    while (!reached.empty()) {
      const std::int32_t t = reached.front();
      reached.pop_front();
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t next = triangle_along(corner(t, (k + 1) % 3), corner(t, k));
        if (next < 0 || done_[static_cast<std::size_t>(next)]) continue;
        done_[static_cast<std::size_t>(next)] = true;
        reached.push_back(next);
        for (std::size_t n = 0; n < 3; ++n) {
          const auto i = static_cast<std::int32_t>(corner(next, n));
          if (place_[static_cast<std::size_t>(i)] == kNowhere) place(i, best_guess(i));
        }
      }
    }
  }

  // Of the triangles beyond those around a particle, whose corners all come before it, that across
  // the longest edge: a grid's cell has the particle on the other end of its diagonal.
  Guess best_guess(std::int32_t particle) const {
    Guess best{particle, count_, count_, count_};
    double longest = -1;
    for (const std::int32_t t : at_[static_cast<std::size_t>(particle)]) {
      std::size_t k = 0;
      while (corner(t, k) != static_cast<std::size_t>(particle)) ++k;
      const std::size_t a = corner(t, (k + 1) % 3), b = corner(t, (k + 2) % 3);
      const std::int32_t beyond = triangle_along(b, a);
      if (beyond < 0) continue;
      std::size_t c = 0;
      for (std::size_t n = 0; n < 3; ++n)
        if (corner(beyond, n) != a && corner(beyond, n) != b) c = corner(beyond, n);
      if (place_[a] == kNowhere || place_[b] == kNowhere || place_[c] == kNowhere) continue;
      const double length = std::hypot(points_.x[a] - points_.x[b], points_.y[a] - points_.y[b],
                                       points_.z[a] - points_.z[b]);
      if (length <= longest) continue;
      longest = length;
      best = {particle, static_cast<std::int32_t>(a), static_cast<std::int32_t>(b),
              static_cast<std::int32_t>(c)};
    }
    return best;
  }

  const std::vector<Triangle>& triangles_;
  const Points& points_;
  std::int32_t count_;
  std::vector<std::vector<std::int32_t>> at_;  // triangles around each particle
  std::unordered_map<std::uint64_t, std::int32_t> across_;
  std::vector<std::int32_t> place_;  // in the order
  std::vector<bool> done_;
  std::vector<Guess> guesses_;
};

}  // namespace

Deflated::Deflated(Sink sink) : sink_(std::move(sink)) {
  constexpr int kWindowBits = 15, kMemory = 9;
  // numbers that are small, and seldom repeat
  if (deflateInit2(&stream_, Z_BEST_COMPRESSION, Z_DEFLATED, kWindowBits, kMemory, Z_FILTERED) !=
      Z_OK)
    throw std::bad_alloc();
}

Deflated::~Deflated() { deflateEnd(&stream_); }

void Deflated::finish() {
  deflate_more({}, Z_FINISH);
  if (!rest_.empty()) sink_(base64(rest_));
}

void Deflated::deflate_more(std::string_view bytes, int flush) {
  std::string input(bytes);  // zlib wants it writable
  stream_.next_in = reinterpret_cast<Bytef*>(input.data());
  stream_.avail_in = static_cast<uInt>(input.size());
  std::array<char, 1 << 14> output{};
  do {
    stream_.next_out = reinterpret_cast<Bytef*>(output.data());
    stream_.avail_out = static_cast<uInt>(output.size());
    deflate(&stream_, flush);
    write_base64({output.data(), output.size() - stream_.avail_out});
  } while (stream_.avail_out == 0);
}

void Deflated::write_base64(std::string_view bytes) {
  rest_ += bytes;
  const std::size_t whole = rest_.size() / 3 * 3;
  std::string text;
  for (std::size_t i = 0; i < whole; i += 3) text += base64({rest_.data() + i, 3});
  rest_.erase(0, whole);
  sink_(text);
}

std::string deflated(std::string_view bytes) {
  std::string text;
  Deflated stream([&](std::string_view more) { text += more; });
  stream.add(bytes);
  stream.finish();
  return text;
}

std::vector<Guess> guesses_of(const std::vector<Triangle>& triangles, const Points& points) {
  return Walk(triangles, points).run();
}

unsigned char Levels::of(double value) const {
  const double share = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0;
  return static_cast<unsigned char>(std::lround(most * std::sqrt(share)));
}

PackedFrames::PackedFrames(Deflated::Sink sink, const std::vector<Guess>& guesses,
                           const std::array<double, 3>& origin_m, double quantum_m)
    : guesses_(guesses), origin_(origin_m), quantum_(quantum_m), deflated_(std::move(sink)) {
  for (auto& last : last_) last.resize(guesses.size());
  for (auto& moves : moves_) moves.resize(guesses.size() + 1);
  std::array<std::vector<std::uint32_t>, 4> columns;
  std::int32_t before = 0;
  for (const auto& [particle, a, b, c] : guesses) {
    std::size_t k = 0;
    for (const std::int32_t number : {particle - before, particle - a, particle - b, particle - c})
      columns[k++].push_back(zigzag(static_cast<std::uint32_t>(number)));
    before = particle;
  }
  for (const auto& column : columns) numbers_.insert(numbers_.end(), column.begin(), column.end());
  write_planes();
}

void PackedFrames::add(const Points& points) {
  const std::array coordinates{&points.x, &points.y, &points.z};
  numbers_.clear();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<std::uint32_t>& last = last_[axis];
    std::vector<std::uint32_t>& moves = moves_[axis];
    for (std::size_t i = 0; i < guesses_.size(); ++i) {
      const double steps = ((*coordinates[axis])[i] - origin_[axis]) / quantum_;
      const auto number = static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(steps)));
      moves[i] = number - last[i];
      last[i] = number;
    }
    const auto move = [&](std::int32_t i) { return moves[static_cast<std::size_t>(i)]; };
    for (const auto& [particle, a, b, c] : guesses_)
      numbers_.push_back(zigzag(move(particle) - (move(a) + move(b) - move(c))));
  }
  write_planes();
}

void PackedFrames::write_planes() {
  planes_.clear();
  for (unsigned plane = 0; plane < 4; ++plane)
    for (const std::uint32_t number : numbers_)
      planes_ += static_cast<char>(number >> (8 * plane) & 255);
  deflated_.add(planes_);
}

}  // namespace weft::client
