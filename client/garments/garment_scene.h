#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/connection.h"
#include "client/figures/dress_form.h"
#include "client/output/json.h"
#include "weft/v1/garment.pb.h"

namespace weft::client {

// A garment to be made of a pattern and put on.
struct GarmentOrder {
  std::string name{};  // of the sheet
  v1::Pattern pattern{};
  v1::Textile textile{};
  std::optional<double> edge_m{};
  std::vector<v1::Collider> bodies{};
  std::optional<double> deflate_m{};  // of bodies, while seams close
  std::string edge_field = "--edge";  // what errors call edge_m
};

struct GarmentScene {
  v1::Scene scene;
  Json json;         // what there is to say about it
  std::string text;  // the same for people
};

// What wears it: a file of triangles, or a dress form.
v1::Collider garment_body(const std::string& path);
v1::Collider garment_body(const DressForm& form);

// Has the server cut the pattern and sew it. The scene dresses the bodies; of what has no
// shoulders, edges labelled "waist", or else the highest border, are held up until then. What is
// wrong with the pattern is a Problem with panel and edge.
GarmentScene make_garment_scene(Connection& connection, const GarmentOrder& order);

}  // namespace weft::client
