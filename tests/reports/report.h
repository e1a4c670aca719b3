#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/output/svg.h"

namespace weft::reports {

using client::Plot;
using client::Series;

// A page in a folder: one table of numbers, pictures, and text that says what they are.
class Page {
 public:
  Page(std::filesystem::path folder, std::vector<std::string> columns);

  void row(const std::vector<std::string>& cells);
  void text(const std::string& markdown);
  // The same table in Markdown, of the rows and columns given.
  void table(const std::vector<std::string>& columns,
             const std::vector<std::vector<std::string>>& rows);
  void plot(const std::string& name, const Plot& plot);
  // Where the caller writes a picture, NAME.webp.
  std::filesystem::path picture(const std::string& name, const std::string& title);
  // Writes NAME.csv and README.md.
  void write() const;

 private:
  std::filesystem::path folder_;
  std::string csv_, markdown_;
};

// "Intel(R) ..., 2 cores; commit 0123abc"
std::string machine(const std::string& commit);
std::string number(double value);
// To two digits; "-" where it is not finite.
std::string short_number(double value);

// Each writes a page; `large` for finer meshes and more cases.
void accuracy(const std::filesystem::path& folder, const std::string& commit, bool large);
void stability(const std::filesystem::path& folder, const std::string& commit, bool large);
void contact(const std::filesystem::path& folder, const std::string& commit, bool large);
void garments(const std::filesystem::path& folder, const std::string& commit, bool large);
void mesh(const std::filesystem::path& folder, const std::string& commit, bool large);
void rest(const std::filesystem::path& folder, const std::string& commit, bool large);
void tethers(const std::filesystem::path& folder, const std::string& commit, bool large);
// Of what weft-bench left in runs.json there.
void speed(const std::filesystem::path& folder, const std::string& commit, bool large);

}  // namespace weft::reports
