#include "client/render/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "client/exports/output_file.h"
#include "client/message_values.h"
#include "client/output/text.h"
#include "client/problem.h"
#include "client/render/picture.h"
#include "client/render/tracer.h"
#include "client/render/webp.h"

namespace weft::client {
namespace {

using Eigen::Vector3d;

constexpr Size kAlone{960, 720}, kAmongOthers{640, 480}, kTurning{480, 360};
constexpr int kTurn = 4000;        // once around, ms
constexpr double kMuchLarger = 4;  // than the cloth: such bodies are not seen as a whole
const Colour kPaper = colour_of("#ffffff");
const Colour kInk = colour_of("#23262b");
const Colour kQuietInk = colour_of("#666b73");

std::vector<std::int64_t> evenly(std::int64_t first, std::int64_t last, int count) {
  std::vector<std::int64_t> numbers;
  for (int i = 0; i < count; ++i)
    numbers.push_back(first + std::llround(static_cast<double>(last - first) * i / (count - 1)));
  return numbers;
}

// The frames that are shown of each recording.
std::vector<std::vector<std::int64_t>> choose_frames(const std::vector<RecordingReader>& recordings,
                                                     const RenderOrder& order) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = 0;
  for (const RecordingReader& recording : recordings) {
    if (recording.last_frame() < recording.first_frame())
      throw usage_problem(recording.path() + " holds no frame");
    first = std::min(first, recording.first_frame());
    last = std::max(last, recording.last_frame());
  }
  std::vector<std::vector<std::int64_t>> chosen;
  for (const RecordingReader& recording : recordings) {
    std::vector<std::int64_t>& frames = chosen.emplace_back(order.frames);
    if (order.contact > 0) frames = evenly(first, last, order.contact);
    if (frames.empty()) frames = {recording.last_frame()};
    for (std::int64_t& frame : frames) {
      const std::int64_t nearest =
          std::clamp(frame, recording.first_frame(), recording.last_frame());
      if (frame != nearest && order.contact == 0) {
        throw Problem(Exit::kRefused, "OUT_OF_RANGE", "NO_SUCH_FRAME",
                      fmt::format("{} has no frame {}; it has {} to {}", recording.path(), frame,
                                  recording.first_frame(), recording.last_frame()));
      }
      frame = nearest;
    }
  }
  return chosen;
}

// How a picture is divided.
struct Layout {
  Size size;
  int columns = 1, rows = 1;

  int tile_width() const { return size.width / columns; }
  int tile_height() const { return size.height / rows; }
};

// As square as fills its lines, or else leaves little of the last one free.
int columns_for(int frames) {
  const int square = static_cast<int>(std::ceil(std::sqrt(frames)));
  for (int columns = square; columns * columns <= 4 * frames; ++columns)
    if (frames % columns == 0) return columns;
  return square;
}

Layout lay_out(const RenderOrder& order, int frames) {
  const int recordings = static_cast<int>(order.recordings.size());
  Layout layout;
  layout.columns = recordings == 1 ? columns_for(frames) : frames == 1 ? recordings : frames;
  layout.rows = (recordings * frames + layout.columns - 1) / layout.columns;
  const bool alone = layout.columns * layout.rows == 1;
  if (order.size) {
    layout.size = *order.size;
  } else {
    const Size tile = order.turntable > 0 ? kTurning : alone ? kAlone : kAmongOthers;
    const double width = tile.width * layout.columns;
    const double height = tile.height * layout.rows;
    const double scale = std::min(1.0, kMostSide / std::max(width, height));
    layout.size = {static_cast<int>(scale * width), static_cast<int>(scale * height)};
  }
  if (layout.tile_width() < kLeastSide || layout.tile_height() < kLeastSide) {
    throw usage_problem(
        fmt::format("{} x {} pixels are too few for {} x {} frames, of {} x {} each at least",
                    layout.size.width, layout.size.height, layout.columns, layout.rows, kLeastSide,
                    kLeastSide));
  }
  return layout;
}

// Where everything that is shown lies.
struct Extent {
  Eigen::AlignedBox3d box;
  double lowest = std::numeric_limits<double>::infinity();  // along up

  void add(const Ball& ball, const Vector3d& up) {
    box.extend(ball.centre + Vector3d::Constant(ball.radius));
    box.extend(ball.centre - Vector3d::Constant(ball.radius));
    lowest = std::min(lowest, ball.centre.dot(up) - ball.radius);
  }
};

// What one look at all the frames finds.
struct Survey {
  Camera camera;
  Studio studio;
};

Margins margins_of(const Layout& layout, float text_size, bool legend, bool names) {
  const double line = text_size / static_cast<double>(layout.tile_height());
  return {.top = (names ? 2 : 0.5) * line, .bottom = (legend ? 4.5 : 2.5) * line};
}

// Of the camera, around what is shown: it is seen from ever further to its right.
Eigen::AngleAxisd turn_of(int view, const RenderOrder& order, const Vector3d& up) {
  return {2 * std::numbers::pi * view / std::max(1, order.turntable), up};
}

// The light goes along with the camera, as if what is seen were turned.
Survey turned(const Survey& survey, const Eigen::AngleAxisd& turn) {
  Survey seen = survey;
  seen.camera = survey.camera.turned(turn, survey.studio.centre);
  Directions& directions = seen.studio.directions;
  directions.near = turn * directions.near;
  directions.right = turn * directions.right;
  return seen;
}

Survey survey_of(std::vector<RecordingReader>& recordings,
                 const std::vector<std::vector<std::int64_t>>& frames, const RenderOrder& order,
                 const Layout& layout, const Margins& margins, const std::stop_token& stop) {
  Survey survey;
  Studio& studio = survey.studio;
  studio.colouring = order.colouring;
  if (const ColourScale* scale = scale_of(order.colouring)) studio.balanced = scale->balanced;
  studio.directions = directions_of(
      vector_of(recordings.front().scene().environment().gravity_m_per_s2()), order.outlook);
  CameraFit fit(studio.directions, order.outlook,
                static_cast<double>(layout.tile_width()) / layout.tile_height(), margins);
  Extent extent;
  std::vector<Ball> shown;
  const auto show = [&](const Ball& ball) {
    shown.push_back(ball);
    extent.add(ball, studio.directions.up);
  };

  std::vector<std::vector<Ball>> hulls;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    for (const std::int64_t number : frames[i]) {
      if (stop.stop_requested()) throw interrupted();
      const Stage stage = read_stage(recordings[i], number, order.colouring);
      for (const Surface& surface : stage.surfaces) {
        const Points& points = surface.points;
        for (std::size_t k = 0; k < points.x.size(); ++k)
          show({{points.x[k], points.y[k], points.z[k]}, 0});
        for (const float value : surface.values)
          studio.most = std::max(studio.most, std::abs(static_cast<double>(value)));
      }
      for (const Body& body : stage.bodies) hulls.push_back(hull_of(body));
    }
  }
  const double reach = extent.box.diagonal().norm();
  for (const std::vector<Ball>& hull : hulls) {
    Extent alone;
    for (const Ball& ball : hull) alone.add(ball, studio.directions.up);
    if (!hull.empty() && alone.box.diagonal().norm() < kMuchLarger * reach)
      std::for_each(hull.begin(), hull.end(), show);
  }
  const double size = extent.box.diagonal().norm();
  studio.centre = extent.box.center();
  studio.radius = std::max(size / 2, 1e-9);
  studio.grid = std::pow(10, std::floor(std::log10(studio.radius / 2)));
  studio.ground = {(extent.lowest - 0.02 * size) * studio.directions.up, studio.directions.up};
  // what turns needs room wherever it comes
  for (int view = 0; view < std::max(1, order.turntable); ++view) {
    const Eigen::AngleAxisd turn = turn_of(view, order, studio.directions.up);
    for (const Ball& ball : shown)
      fit.add(view == 0 ? ball
                        : Ball{studio.centre + turn * (ball.centre - studio.centre), ball.radius});
  }
  survey.camera = fit.camera();
  return survey;
}

// Text that is made smaller where it is too long.
void write_within(Picture& picture, const std::string& text, float size, float x, float y,
                  float width, const Colour& colour) {
  const float needed = text_width(text, size);
  write_text(picture, text, needed > width ? size * width / needed : size, x, y, colour);
}

// The ramp, what it means, and its ends.
void draw_legend(Picture& picture, const ColourScale& scale, double largest, const Area& area,
                 float text) {
  const std::string title = scale.title;
  const std::string most = scale.text(largest);
  const float width =
      std::min(std::max(text_width(title, text), 12 * text), 0.5F * static_cast<float>(area.width));
  const float right = static_cast<float>(area.x + area.width) - text;
  const float left = right - width;
  const float bottom = static_cast<float>(area.y + area.height) - text;
  write_within(picture, title, text, left, bottom - 2.1F * text, width, kInk);
  for (int y = static_cast<int>(bottom - 1.7F * text); y < static_cast<int>(bottom - text); ++y) {
    for (int x = static_cast<int>(left); x < static_cast<int>(right); ++x)
      picture.cover(x, y, ramp_colour((static_cast<float>(x) - left) / width, scale.balanced), 1);
  }
  write_text(picture, scale.balanced ? scale.text(-largest) : "0", text, left, bottom, kQuietInk);
  write_text(picture, most, text, right - text_width(most, text), bottom, kQuietInk);
}

}  // namespace

bool ends_with_webp(const std::string& path) {
  return std::filesystem::path(path).extension() == ".webp";
}

const ColourScale* scale_of(Colouring colouring) {
  static constexpr ColourScale kStrain{"strain", "strain, largest at a particle", "largest_strain",
                                       percent_text};
  static constexpr ColourScale kWarp{"warp strain", "strain along the warp", "largest_warp_strain",
                                     percent_text, true};
  static constexpr ColourScale kWeft{"weft strain", "strain along the weft", "largest_weft_strain",
                                     percent_text, true};
  static constexpr ColourScale kShear{"shear", "shear, sine of its angle", "largest_shear",
                                      percent_text, true};
  static constexpr ColourScale kSpeed{"speed", "speed", "largest_speed_m_per_s",
                                      [](double value) { return number_text(value) + " m/s"; }};
  static constexpr ColourScale kBending{"bending energy", "bending energy",
                                        "largest_bending_energy_j_per_m2",
                                        [](double value) { return number_text(value) + " J/m²"; }};
  switch (colouring) {
    case Colouring::kCloth:
    case Colouring::kPanels:
      break;
    case Colouring::kStrain:
      return &kStrain;
    case Colouring::kWarp:
      return &kWarp;
    case Colouring::kWeft:
      return &kWeft;
    case Colouring::kShear:
      return &kShear;
    case Colouring::kSpeed:
      return &kSpeed;
    case Colouring::kBending:
      return &kBending;
  }
  return nullptr;
}

RenderResult render(const RenderOrder& order,
                    const std::function<void(const std::string& doing)>& progress,
                    const std::stop_token& stop) {
  std::vector<RecordingReader> recordings;
  for (const std::string& path : order.recordings) recordings.emplace_back(path);
  RenderResult result;
  result.frames = choose_frames(recordings, order);
  const Layout layout = lay_out(order, static_cast<int>(result.frames.front().size()));
  const float text = std::clamp(
      static_cast<float>(std::min(layout.tile_height(), layout.tile_width())) / 32, 8.0F, 48.0F);
  const bool names = recordings.size() > 1;
  const ColourScale* legend = scale_of(order.colouring);
  progress("looking at the frames");
  const Survey survey = survey_of(recordings, result.frames, order, layout,
                                  margins_of(layout, text, legend != nullptr, names), stop);

  result.views = std::max(1, order.turntable);
  Picture picture(layout.size.width, layout.size.height);
  const int gap = layout.columns * layout.rows == 1 ? 0 : std::max(1, layout.tile_width() / 400);
  const int tiles = static_cast<int>(recordings.size() * result.frames.front().size());
  const auto draw = [&](const Survey& seen, int drawn) {
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x) picture.cover(x, y, kPaper, 1);
    int place = 0;
    Area area;
    for (std::size_t i = 0; i < recordings.size(); ++i) {
      for (const std::int64_t number : result.frames[i]) {
        progress(fmt::format("{}: {} of {}", order.path, drawn + place + 1, tiles * result.views));
        area = {place % layout.columns * layout.size.width / layout.columns + gap,
                place / layout.columns * layout.size.height / layout.rows + gap,
                layout.tile_width() - 2 * gap, layout.tile_height() - 2 * gap};
        const Stage stage = read_stage(recordings[i], number, order.colouring);
        Tracer(stage, seen.studio).draw(seen.camera, picture, area, stop);
        const float left = static_cast<float>(area.x) + text;
        const float width = static_cast<float>(area.width) - 2 * text;
        if (names) {
          write_within(picture, std::filesystem::path(order.recordings[i]).stem().string(),
                       1.25F * text, left, static_cast<float>(area.y) + 2 * text, width, kInk);
        }
        write_within(picture,
                     fmt::format("frame {}, {}, grid {} m", number, seconds_text(stage.time_s),
                                 number_text(seen.studio.grid)),
                     text, left, static_cast<float>(area.y + area.height) - text,
                     legend != nullptr ? width / 2.5F : width, kQuietInk);
        ++place;
      }
    }
    if (legend != nullptr) draw_legend(picture, *legend, seen.studio.most, area, text);
  };

  std::string bytes;
  if (order.turntable > 0) {
    WebpAnimation animation(picture.width(), picture.height(), kTurn / order.turntable);
    for (int view = 0; view < order.turntable; ++view) {
      draw(turned(survey, turn_of(view, order, survey.studio.directions.up)), tiles * view);
      animation.add(picture);
    }
    bytes = animation.finish();
  } else {
    draw(survey, 0);
    bytes = ends_with_webp(order.path) ? webp(picture) : picture.png();
  }

  OutputFile file(order.path);
  file.write(bytes);
  file.close();
  result.size = layout.size;
  result.most = survey.studio.most;
  result.grid_m = survey.studio.grid;
  return result;
}

}  // namespace weft::client
