#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/figures/dress_forms.h"
#include "client/garments/garment_scene.h"
#include "client/imports/garment_code.h"

namespace weft::client {

// Who wears what.
struct Drape {
  std::string garment{};  // a template, or a pattern file
  Measures measures{};    // of the dress form
  // To have it from.
  std::shared_ptr<DressForms> forms = std::make_shared<DressForms>();
  std::vector<std::string> bodies{};     // files; none: the dress form
  std::string over{};                    // a recording of what is worn beneath, and by whom
  std::optional<v1::Textile> textile{};  // none: the usual one
  std::optional<double> edge_m{}, deflate_m{};
  std::optional<v1::Accuracy> accuracy{};
  std::vector<std::pair<std::string, std::string>> values{};  // of the scene, by their places
  std::string edge_field = "--edge";                          // what errors call edge_m
};

bool is_garment_template(const std::string& name);
// A pattern file. Where there is none, the problem names garments that there are.
ImportedPattern read_garment(const std::string& path);

// Makes the garment for the form, or reads it, and has the server sew it. What is to be said of a
// file comes first.
GarmentScene make_drape(Connection& connection, const Drape& drape);

}  // namespace weft::client
