#include "client/garments/drape.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "client/garments/garment_templates.h"
#include "client/garments/layers.h"
#include "client/garments/pattern_file.h"
#include "client/message_field.h"
#include "client/output/text.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

std::optional<GarmentInfo> template_called(const std::string& name) {
  for (const GarmentInfo& each : garment_templates())
    if (each.name == name) return each;
  return std::nullopt;
}

}  // namespace

bool is_garment_template(const std::string& name) { return template_called(name).has_value(); }

ImportedPattern read_garment(const std::string& path) {
  if (std::filesystem::exists(path)) return read_pattern(path);
  std::string names;
  for (const GarmentInfo& each : garment_templates())
    names += (names.empty() ? "" : ", ") + each.name;
  throw unreadable(path, "there is no such file, nor is it one of " + names);
}

GarmentScene make_drape(Connection& connection, const Drape& drape) {
  const std::optional<GarmentInfo> own = template_called(drape.garment);
  GarmentOrder order{
      .textile = drape.textile ? *drape.textile : textile_named(own ? own->textile : kUsualTextile),
      .edge_m = drape.edge_m,
      .deflate_m = drape.deflate_m,
      .edge_field = drape.edge_field};
  std::string notes;
  std::shared_ptr<const DressForm> form;
  const bool on_form = drape.bodies.empty() && drape.over.empty();
  if (own || on_form) form = drape.forms->of(drape.measures);
  if (own) {
    order.name = drape.garment;
    order.pattern = make_garment(drape.garment, *form);
    if (!order.deflate_m && own->deflate_m > 0) order.deflate_m = own->deflate_m;
  } else {
    order.name = plain_name(std::filesystem::path(drape.garment).stem().string(), "garment");
    ImportedPattern read = read_garment(drape.garment);
    order.pattern = std::move(read.pattern);
    for (const std::string& note : read.notes) notes += note + '\n';
  }
  std::optional<Worn> worn;
  if (!drape.over.empty()) {
    worn = worn_at_end(drape.over);
    if (const double way = place_over(order.pattern, *worn); way > 0)
      notes += fmt::format("panels start up to {:.0f} mm farther out, clear of what is worn\n",
                           1000 * way);
  }
  for (const std::string& path : drape.bodies) order.bodies.push_back(garment_body(path));
  if (on_form) order.bodies.push_back(garment_body(*form));

  GarmentScene made = make_garment_scene(connection, order);
  made.text.insert(0, notes);
  if (worn) wear_over(made.scene, std::move(*worn));
  if (drape.accuracy) made.scene.mutable_solver()->set_accuracy(*drape.accuracy);
  for (const auto& [place, value] : drape.values) set_field(made.scene, place, value);
  return made;
}

}  // namespace weft::client
