#include "client/render/tracer.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "client/page/page.h"
#include "client/problem.h"
#include "client/processors.h"

namespace weft::client {
namespace {

using Eigen::Vector3f;

constexpr std::uint32_t kSamples = 16;  // of a pixel
constexpr float kFar = std::numeric_limits<float>::infinity();

// Light: full on a surface that faces the sun under open sky.
constexpr float kSun = 0.78F;
constexpr float kSky = 0.42F;
constexpr float kThrough = 0.22F;   // of the sun, to the far side of cloth
constexpr float kBounce = 0.16F;    // of the sky, from what hides it
constexpr float kSunWidth = 0.07F;  // tangent of its radius

// The ground under open sky has the colour of the horizon.
constexpr float kGroundSun = 0.5F;
// Brightness of the sky at the level, and how much more there is straight up.
constexpr float kSkyLevel = 0.72F, kSkyRise = 0.28F;
constexpr float kGroundNear = 2.2F, kGroundFar = 7;  // where it fades, radii

const Colour kHorizon = colour_of("#e9eaec");
const Colour kZenith = colour_of("#fafafa");
const Colour kBody = colour_of("#aeb6bf");

struct Tints {
  Colour front, back;
};

// Of the sheets, or of the panels, in turn.
const std::array kTints{Tints{colour_of("#c8553d"), colour_of("#e3b7a0")},
                        Tints{colour_of("#2f6f9f"), colour_of("#a9c6d8")},
                        Tints{colour_of("#4b8b5a"), colour_of("#b9d3b6")},
                        Tints{colour_of("#8a5a9e"), colour_of("#cdb8d6")}};

// Bits of an integer, well mixed (Wellons' lowbias32).
std::uint32_t mixed(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352dU;
  x = (x ^ x >> 15) * 0x846ca68bU;
  return x ^ x >> 16;
}

float unit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24F; }

// The first points of Sobol's sequence in two dimensions, in 32 bits (Kollig and Keller 2002).
struct Sobol {
  std::array<std::uint32_t, kSamples> x{}, y{};

  constexpr Sobol() {
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      std::uint32_t u = 1U << 31;
      std::uint32_t v = 1U << 31;
      for (std::uint32_t bits = i; bits != 0; bits >>= 1, u >>= 1, v ^= v >> 1) {
        if ((bits & 1) == 0) continue;
        x[i] ^= u;
        y[i] ^= v;
      }
    }
  }
};
constexpr Sobol kSobol;

struct Pair {
  float x, y;
};

// A sample of a pixel: any number of points that, with those of the pixel's other samples, cover
// the unit square evenly.
class Sample {
 public:
  Sample(std::uint32_t pixel, std::uint32_t index) : pixel_(pixel), index_(index) {}

  Pair next() {
    const std::uint32_t seed = mixed(pixel_ + ++taken_ * 0x9e3779b9U);
    const std::uint32_t index = index_ ^ (seed & (kSamples - 1));
    return {unit(kSobol.x[index] ^ mixed(seed)), unit(kSobol.y[index] ^ mixed(seed + 1))};
  }

 private:
  std::uint32_t pixel_;
  std::uint32_t index_;
  std::uint32_t taken_ = 0;
};

Pair disc(Pair square) {
  const float radius = std::sqrt(square.x);
  const float angle = 2 * std::numbers::pi_v<float> * square.y;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

// Where a point of the disc around an axis lies, the axis being the third direction.
Vector3f around(const Vector3f& axis, Pair point, float height) {
  const Vector3f side = axis.unitOrthogonal();
  return (point.x * side + point.y * axis.cross(side) + height * axis).normalized();
}

float smoothstep(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

Colour mix(const Colour& a, const Colour& b, float share) { return a + share * (b - a); }

}  // namespace

Colour ramp_colour(float share, bool balanced) {
  const auto colours_of = [](const std::vector<std::string_view>& names) {
    std::vector<Colour> colours;
    for (const std::string_view hex : names) colours.push_back(colour_of(hex));
    return colours;
  };
  static const std::vector<Colour> from_nought = colours_of(page_ramp());
  static const std::vector<Colour> around_nought = colours_of(page_balance());
  const std::vector<Colour>& ramp = balanced ? around_nought : from_nought;
  const float place = std::clamp(share, 0.0F, 1.0F) * static_cast<float>(ramp.size() - 1);
  const auto from = std::min(static_cast<std::size_t>(place), ramp.size() - 2);
  return mix(ramp[from], ramp[from + 1], place - static_cast<float>(from));
}

class Tracer::Rays {
 public:
  Rays(const Stage& stage, const Studio& studio)
      : stage_(stage),
        studio_(studio),
        device_(rtcNewDevice("threads=1")),  // so that a tree is always the same
        scene_(device_ != nullptr ? rtcNewScene(device_.get()) : nullptr),
        up_(studio.directions.up.cast<float>()),
        radius_(static_cast<float>(studio.radius)),
        lift_(1e-4F * radius_) {
    if (scene_ == nullptr) throw std::runtime_error("Embree does not start on this processor");
    sun_ =
        (2.4 * studio.directions.up + 1.1 * studio.directions.near - 1.2 * studio.directions.right)
            .normalized()
            .cast<float>();
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    for (const Surface& surface : stage.surfaces) add(surface);
    for (const Body& body : stage.bodies) add(body);
    if (planes_.empty()) add_plane(studio.ground);
    rtcCommitScene(scene_.get());
    if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE)
      throw std::runtime_error("Embree cannot hold this frame: error " + std::to_string(error));
  }

  Vector3f local(const Eigen::Vector3d& place) const {
    return (place - studio_.centre).cast<float>();
  }

  // What comes to a camera from a direction.
  Colour seen(const Vector3f& from, const Vector3f& direction, Sample& sample) const {
    RTCRayHit ray{};
    aim(ray.ray, from, direction);
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_.get(), &context, &ray);

    const Plane* plane = nullptr;
    float nearest = ray.ray.tfar;
    for (const Plane& candidate : planes_) {
      const float towards = candidate.normal.dot(direction);
      const float distance = candidate.normal.dot(candidate.point - from) / towards;
      if (towards < 0 && distance > 0 && distance < nearest) {
        nearest = distance;
        plane = &candidate;
      }
    }
    const Vector3f place = from + nearest * direction;
    if (plane != nullptr) return ground_colour(*plane, place, direction, sample);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return background(direction);
    if (ray.hit.geomID < stage_.surfaces.size())
      return cloth_colour(ray.hit, place, direction, sample);
    const Body& body = stage_.bodies[solids_[ray.hit.geomID - stage_.surfaces.size()]];
    if (const auto* solid = std::get_if<Solid>(&body))
      return solid_colour(*solid, ray.hit, place, direction, sample);
    const Vector3f normal =
        way_out(body, place.cast<double>() + studio_.centre).direction.cast<float>();
    return kBody * light(place, normal, normal, 0, sample);
  }

 private:
  struct Plane {
    Vector3f point, normal;
  };

  static void aim(RTCRay& ray, const Vector3f& from, const Vector3f& direction) {
    ray.org_x = from.x();
    ray.org_y = from.y();
    ray.org_z = from.z();
    ray.dir_x = direction.x();
    ray.dir_y = direction.y();
    ray.dir_z = direction.z();
    ray.tnear = 0;
    ray.tfar = kFar;
    ray.mask = ~0U;
  }

  template <class Number>
  Number* buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t size,
                 std::size_t count) {
    void* made = rtcSetNewGeometryBuffer(geometry, type, 0, format, size, count);
    if (made == nullptr) throw std::bad_alloc();
    return static_cast<Number*>(made);
  }

  RTCGeometry geometry(RTCGeometryType type) {
    RTCGeometry made = rtcNewGeometry(device_.get(), type);
    if (made == nullptr) throw std::runtime_error("this Embree lacks a shape that Weft needs");
    return made;
  }

  void attach(RTCGeometry geometry) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);  // numbered from 0 in this order
    rtcReleaseGeometry(geometry);
  }

  void add_triangles(const std::vector<Vector3f>& corners,
                     const std::vector<std::uint32_t>& triangles) {
    RTCGeometry mesh = geometry(RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* places = buffer<float>(mesh, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                 corners.size());
    for (const Vector3f& corner : corners) places = std::copy_n(corner.data(), 3, places);
    std::copy(triangles.begin(), triangles.end(),
              buffer<std::uint32_t>(mesh, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
                                    3 * sizeof(std::uint32_t), triangles.size() / 3));
    attach(mesh);
  }

  void add(const Surface& surface) {
    std::vector<Vector3f>& corners = corners_.emplace_back();
    for (std::size_t i = 0; i < surface.points.x.size(); ++i)
      corners.push_back(local({surface.points.x[i], surface.points.y[i], surface.points.z[i]}));
    add_triangles(corners, surface.triangles);
  }

  void add_plane(const HalfSpace& space) {
    // its point next to the centre, for the sake of single precision
    const double height = (space.point - studio_.centre).dot(space.normal);
    planes_.push_back({(height * space.normal).cast<float>(), space.normal.cast<float>()});
  }

  void add(const Body& body) {
    if (const auto* space = std::get_if<HalfSpace>(&body)) {
      add_plane(*space);
      return;
    }
    solids_.push_back(static_cast<std::size_t>(&body - stage_.bodies.data()));
    const std::vector<Ball> hull = hull_of(body);
    std::vector<Vector3f> corners;
    for (const Ball& ball : hull) corners.push_back(local(ball.centre));
    if (const auto* solid = std::get_if<Solid>(&body)) {
      add_triangles(corners, solid->triangles);
      return;
    }
    if (std::holds_alternative<Cuboid>(body)) {
      // the sides where x, y, z are least, and where they are most
      add_triangles(corners, {0, 2, 6, 0, 6, 4, 0, 1, 5, 0, 5, 4, 0, 1, 3, 0, 3, 2,
                              1, 3, 7, 1, 7, 5, 2, 3, 7, 2, 7, 6, 4, 5, 7, 4, 7, 6});
      return;
    }
    const bool round = hull.size() == 1 || corners[0] == corners[1];
    RTCGeometry shape =
        geometry(round ? RTC_GEOMETRY_TYPE_SPHERE_POINT : RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
    const std::size_t count = round ? 1 : 2;
    auto* places =
        buffer<float>(shape, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, 4 * sizeof(float), count);
    for (std::size_t i = 0; i < count; ++i) {
      places = std::copy_n(corners[i].data(), 3, places);
      *places++ = static_cast<float>(hull[i].radius);
    }
    if (!round)
      *buffer<std::uint32_t>(shape, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, sizeof(std::uint32_t),
                             1) = 0;
    attach(shape);
  }

  bool hidden(const Vector3f& from, const Vector3f& direction) const {
    RTCRay ray{};
    aim(ray, from, direction);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_.get(), &context, &ray);
    return ray.tfar < 0;
  }

  Colour background(const Vector3f& direction) const {
    return mix(kHorizon, kZenith, smoothstep(0, 0.5F, direction.dot(up_)));
  }

  // The sun above the surface; the share that cloth lets through, where it stands behind.
  float sun_on(const Vector3f& place, const Vector3f& face, const Vector3f& normal, float through,
               Sample& sample) const {
    const Pair point = disc(sample.next());
    const Vector3f towards = around(sun_, {kSunWidth * point.x, kSunWidth * point.y}, 1);
    const float slope = normal.dot(towards);
    const float share = slope > 0 ? slope : -through * slope;
    const Vector3f side = face.dot(towards) > 0 ? face : Vector3f(-face);
    return share > 0 && !hidden(place + lift_ * side, towards) ? share : 0;
  }

  // The sky over a surface, 0 to 1; evenly bright, and less below the level.
  float sky_on(const Vector3f& place, const Vector3f& face, const Vector3f& normal,
               Sample& sample) const {
    const Pair square = sample.next();
    const Vector3f towards = around(normal, disc(square), std::sqrt(1 - square.x));
    if (hidden(place + lift_ * face, towards)) return kBounce;
    return kSkyLevel + kSkyRise * towards.dot(up_);
  }

  // face: of the geometry, normal: smooth; both on the side of the camera.
  float light(const Vector3f& place, const Vector3f& face, const Vector3f& normal, float through,
              Sample& sample) const {
    const float sun = sun_on(place, face, normal, through, sample);
    return kSun * sun + kSky * sky_on(place, face, normal, sample);
  }

  Colour cloth_colour(const RTCHit& hit, const Vector3f& place, const Vector3f& direction,
                      Sample& sample) const {
    const Surface& surface = stage_.surfaces[hit.geomID];
    const std::vector<Vector3f>& corners = corners_[hit.geomID];
    const std::uint32_t* triangle = &surface.triangles[3 * std::size_t{hit.primID}];
    const std::array weights{1 - hit.u - hit.v, hit.u, hit.v};
    Vector3f normal = Vector3f::Zero();
    float value = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      normal += weights[k] * Vector3f(surface.normals[triangle[k]].data());
      value += weights[k] * surface.values[triangle[k]];
    }
    Vector3f face = (corners[triangle[1]] - corners[triangle[0]])
                        .cross(corners[triangle[2]] - corners[triangle[0]])
                        .normalized();
    normal.normalize();
    const bool front = face.dot(direction) < 0;
    if (!front) {
      face = -face;
      normal = -normal;
    }
    const bool by_panel = studio_.colouring == Colouring::kPanels;
    const std::size_t tinted =
        by_panel ? static_cast<std::size_t>(surface.panels[hit.primID]) : hit.geomID;
    const Tints& tints = kTints[tinted % kTints.size()];
    Colour tint = front ? tints.front : tints.back;
    if (!by_panel && studio_.colouring != Colouring::kCloth) {
      const float share = studio_.most > 0 ? value / static_cast<float>(studio_.most) : 0;
      tint = ramp_colour(studio_.balanced ? (1 + share) / 2 : share, studio_.balanced);
    }
    // fibres that stand out catch light at a glancing view
    const float glance = 1 - std::abs(normal.dot(direction));
    const float fuzz = 0.10F * glance * glance * glance;
    return mix(tint, Colour::Ones(), fuzz) * light(place, face, normal, kThrough, sample);
  }

  // Smooth, but for edges that turn by more than 40 degrees.
  Colour solid_colour(const Solid& solid, const RTCHit& hit, const Vector3f& place,
                      const Vector3f& direction, Sample& sample) const {
    constexpr float kSmooth = 0.77F;
    const std::uint32_t* triangle = &solid.triangles[3 * std::size_t{hit.primID}];
    const auto corner = [&](std::size_t k) {
      const Points& at = solid.corners;
      return Eigen::Vector3d(at.x[triangle[k]], at.y[triangle[k]], at.z[triangle[k]]);
    };
    Vector3f face = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized().cast<float>();
    const std::array weights{1 - hit.u - hit.v, hit.u, hit.v};
    Vector3f normal = Vector3f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3f at(solid.normals[triangle[k]].data());
      normal += weights[k] * (at.dot(face) > kSmooth ? at : face);
    }
    normal.normalize();
    if (face.dot(direction) > 0) {
      face = -face;
      normal = -normal;
    }
    return kBody * light(place, face, normal, 0, sample);
  }

  Colour ground_colour(const Plane& plane, const Vector3f& place, const Vector3f& direction,
                       Sample& sample) const {
    const float sun = sun_on(place, plane.normal, plane.normal, 0, sample) / sun_.dot(up_);
    const float sky = sky_on(place, plane.normal, plane.normal, sample);
    // the mean of an open sky over the level
    constexpr float kOpenSky = kSkyLevel + kSkyRise * 2 / 3;
    const float light = kGroundSun * sun + (1 - kGroundSun) * sky / kOpenSky;
    const Colour colour = kHorizon * light * (on_grid(plane, place) ? 0.86F : 1.0F);
    const float fade = smoothstep(kGroundNear, kGroundFar, place.norm() / radius_);
    return mix(colour, background(direction), fade);
  }

  bool on_grid(const Plane& plane, const Vector3f& place) const {
    const Vector3f u = plane.normal.unitOrthogonal();
    const Vector3f across = place + studio_.centre.cast<float>();
    const float cell = static_cast<float>(studio_.grid);
    const auto near_line = [&](float x) {
      const float cells = x / cell;
      return std::abs(cells - std::round(cells)) < 0.008F;
    };
    return near_line(u.dot(across)) || near_line(plane.normal.cross(u).dot(across));
  }

  const Stage& stage_;
  const Studio& studio_;
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
  Vector3f up_;
  Vector3f sun_;  // towards it
  float radius_;
  float lift_;                                  // of rays off the surface they start from, m
  std::vector<std::vector<Vector3f>> corners_;  // of the surfaces
  std::vector<std::size_t> solids_;             // the bodies that are geometries
  std::vector<Plane> planes_;
};

Tracer::Tracer(const Stage& stage, const Studio& studio)
    : rays_(std::make_unique<Rays>(stage, studio)) {}

Tracer::~Tracer() = default;

void Tracer::draw(const Camera& camera, Picture& picture, const Area& area,
                  const std::stop_token& stop) const {
  const Vector3f from = rays_->local(camera.place);
  on_all_processors(area.height, [&](int row) {
    if (stop.stop_requested()) return;
    for (int column = 0; column < area.width; ++column) {
      const auto pixel =
          mixed(static_cast<std::uint32_t>(row) << 16 | static_cast<std::uint32_t>(column));
      Colour sum = Colour::Zero();
      for (std::uint32_t i = 0; i < kSamples; ++i) {
        Sample sample(pixel, i);
        const Pair place = sample.next();
        const double x = 2 * (column + double{place.x}) / area.width - 1;
        const double y = 1 - 2 * (row + double{place.y}) / area.height;
        sum += rays_->seen(from, camera.ray(x, y).cast<float>(), sample).min(1);
      }
      picture.set(area.x + column, area.y + row, sum / kSamples);
    }
  });
  if (stop.stop_requested()) throw interrupted();
}

}  // namespace weft::client
