// Speed: the figures of weft-bench, each beside its error or beside what it is a ratio to.
#include <fmt/format.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "tests/reports/operations.h"
#include "tests/reports/report.h"

namespace weft::reports {
namespace {

using Cells = std::vector<std::string>;

struct Run {
  double time = 0;   // of an iteration, ns, as the median of the repetitions
  double items = 0;  // per second: evaluations or particle-substeps
  double error = 0;
  double bytes = 0, bytes_packed = 0;

  double item_time() const { return 1e9 / items; }  // ns
};

class SpeedPage {
 public:
  SpeedPage(const std::filesystem::path& folder, const std::string& commit)
      : page_(folder, {"benchmark", "median_ns", "items_per_s", "error", "bytes"}) {
    const std::filesystem::path path = folder / "runs.json";
    std::ifstream file(path);
    if (!file) throw std::runtime_error("no " + path.string() + "; weft-bench writes it");
    const auto answer = nlohmann::json::parse(file);
    for (const auto& run : answer.at("benchmarks")) {
      if (run.value("aggregate_name", "") != "median" || run.value("error_occurred", false))
        continue;
      const auto value = [&](const char* name) { return run.value(name, 0.0); };
      const Run median{value("cpu_time"), value("items_per_second"), value("error"), value("bytes"),
                       value("bytes_packed")};
      const std::string name = run.at("run_name");
      runs_[name] = median;
      page_.row({name, number(median.time), number(median.items), number(median.error),
                 number(median.bytes)});
    }
    page_.text("# Speed");
    page_.text("Made by `./dev bench speed` on " + machine(commit) +
               ". Medians of five repetitions in random order within one run: compare the ratios, "
               "for processors and their other work differ.");
  }

  void write() {
    bending();
    operations();
    substeps();
    memory();
    page_.write();
  }

 private:
  const Run* find(const std::string& name) const {
    const auto found = runs_.find(name);
    return found == runs_.end() ? nullptr : &found->second;
  }
  static std::string times(const Run* slow, const Run* fast) {
    return slow && fast ? fmt::format("{:.1f} x", slow->item_time() / fast->item_time()) : "";
  }

  void bending() {
    page_.text("## The bending function");
    page_.text(
        "One evaluation of f_b, lengths spread evenly; the baseline is the series of eq. 6 (ten "
        "terms, Horner, libm). One by one: double precision, -O2. In vectors: single precision, "
        "as the kernels do it, on the widest vectors of this processor. OPTIMAL: LINEARIZED at "
        "optimal breakpoints; up to 32 segments are kept in registers. The error is the largest "
        "relative one, for vectors up to lengths of 0.999.");
    evaluators("bending", "ns");
    page_.text("## Bending of a whole sheet");
    page_.text(
        "All bend connections of 31 x 31 particles hung by two corners, a step, averaged over 64 "
        "steps of 0.1 s (the paper's experiment 1, for which it reports 5.72 x). One by one skips "
        "the connections that are not shortened, vectors compute them and throw them away.");
    evaluators("bending_31x31", "us a step");
    const Run* table = find("bending_table/32");
    const Run* large = find("bending_table/1024");
    if (table && large)
      page_.text(fmt::format(
          "A table of 32 segments takes {:.1f} us to build, one of 1024 takes {:.1f} us.",
          1e-3 * table->time, 1e-3 * large->time));
  }

  // Of one evaluation, or of one iteration where the benchmark goes over a sheet.
  void evaluators(const std::string& name, const std::string& unit) {
    const bool sheet = unit != "ns";
    const auto time = [&](const Run* run) {
      if (!run) return std::string();
      return sheet ? fmt::format("{:.2f}", 1e-3 * run->time)
                   : fmt::format("{:.3f}", run->item_time());
    };
    const Run* series = find(name + "_scalar/SERIES");
    const Run* vector_series = find(name + "/SERIES");
    std::vector<Cells> rows;
    Plot plot{
        "f_b: time against error", "time ns", "largest relative error", {}, true, false, true};
    std::map<std::string, Series> lines;
    const auto add = [&](const std::string& evaluator, const char* how, const Run* run) {
      if (!run || run->error == 0) return;  // there is no logarithm of 0
      const std::string kind = evaluator.substr(0, evaluator.find('/')) + ", " + how;
      lines[kind].name = kind;
      lines[kind].points.emplace_back(run->item_time(), run->error);
    };
    for (const char* evaluator :
         {"SERIES", "EXACT", "LINEARIZED/2", "LINEARIZED/5", "LINEARIZED/16", "LINEARIZED/32",
          "LINEARIZED/60", "LINEARIZED/256", "LINEARIZED/1024", "OPTIMAL/2", "OPTIMAL/5",
          "OPTIMAL/16", "OPTIMAL/32", "OPTIMAL/60", "POLYNOMIAL/5", "POLYNOMIAL/7",
          "POLYNOMIAL/10"}) {
      const Run* scalar = find(name + "_scalar/" + evaluator);
      const Run* vector = find(name + "/" + evaluator);
      const Run* error = find(std::string("bending_scalar/") + evaluator);
      const Run* vector_error = find(std::string("bending/") + evaluator);
      rows.push_back({evaluator, error ? number(error->error) : "",
                      vector_error ? number(vector_error->error) : "", time(scalar), time(vector),
                      times(series, scalar), times(vector_series, vector), times(series, vector)});
      add(evaluator, "one by one", scalar);
      add(evaluator, "in vectors", vector);
    }
    for (const auto& [kind, line] : lines) plot.series.push_back(line);
    page_.table(
        {"evaluator", "error", "error in vectors", "one by one, " + unit, "in vectors, " + unit,
         "one by one / one by one", "vectors / vectors", "one by one / vectors"},
        rows);
    if (!sheet) page_.plot("bending", plot);
  }

  // Of the paper's Tables I and II, beside what was measured.
  void operations() {
    const auto cells = [](const CountedFormula& formula) {
      Cells row = {formula.name};
      const Operations& o = formula.operations;
      for (const int count : {o.add, o.subtract, o.multiply, o.divide, o.root, o.cosine, o.compare})
        row.push_back(std::to_string(count));
      return row;
    };
    page_.text("## Operations");
    page_.text(
        "Counted by a number type that counts, in formulas that are held to what the solver "
        "computes. The paper's Table I: g at r = 0.55; eq. 6 as it is printed has every power "
        "multiplied from the start. Beside it what the paper counts for all of eq. 5, and for a "
        "segment that is searched for.");
    const Cells names = {"formula", "+", "-", "x", "/", "sqrt", "cos", "comparisons"};
    Cells columns = names;
    columns.emplace_back("ns");
    std::vector<Cells> rows;
    const std::map<std::string, std::string> measured = {{"series, Horner", "SERIES"},
                                                         {"5 segments, searched", "SEARCHED/5"},
                                                         {"32 segments, searched", "SEARCHED/32"},
                                                         {"60 segments, searched", "SEARCHED/60"},
                                                         {"5 segments, indexed", "LINEARIZED/5"},
                                                         {"32 segments, indexed", "LINEARIZED/32"},
                                                         {"60 segments, indexed", "LINEARIZED/60"}};
    for (const CountedFormula& formula : count_bending()) {
      Cells row = cells(formula);
      const auto name = measured.find(formula.name);
      const Run* run = name == measured.end() ? nullptr : find("bending_scalar/" + name->second);
      row.push_back(run ? fmt::format("{:.2f}", run->item_time()) : "");
      rows.push_back(row);
    }
    rows.push_back({"paper: eq. 5", "9", "2", "105", "13", "1", "1 and a sinc", "3", ""});
    rows.push_back({"paper: a segment", "1", "0", "1", "0", "0", "0", "N / 2", ""});
    page_.table(columns, rows);

    page_.text(
        "Its Table II: one step of one particle in three dimensions, given its forces, constants "
        "of the step known before. The paper gives Runge-Kutta three evaluations of the forces and "
        "Euler two; they are four and one, and those are what a step of cloth costs. The time is "
        "the whole step where forces cost nothing, with velocities for damping.");
    columns = names;
    columns.insert(columns.end(), {"forces", "ns"});
    rows.clear();
    const std::map<std::string, std::string> integrators = {{"Verlet, summed", "VERLET"},
                                                            {"Euler", "EULER"},
                                                            {"midpoint", "MIDPOINT"},
                                                            {"Runge-Kutta 4", "RK4"}};
    for (const CountedFormula& formula : count_steps()) {
      Cells row = cells(formula);
      const auto name = integrators.find(formula.name);
      const Run* run = name == integrators.end() ? nullptr : find("integrator/" + name->second);
      row.push_back(fmt::format("{:.0f}", formula.forces));
      row.push_back(run ? fmt::format("{:.2f}", run->item_time()) : "");
      rows.push_back(row);
    }
    rows.push_back({"paper: Verlet", "6", "3", "4", "0", "", "", "", "1", ""});
    rows.push_back({"paper: Euler", "6", "0", "7", "0", "", "", "", "2", ""});
    rows.push_back({"paper: midpoint", "12", "0", "14", "1", "", "", "", "2", ""});
    rows.push_back({"paper: Runge-Kutta 4", "42", "0", "48", "2", "", "", "", "3", ""});
    page_.table(columns, rows);
  }

  void substeps() {
    page_.text("## The whole substep");
    page_.text(
        "Million particle-substeps a second of a sheet hung by two corners: stretch, shear, bend "
        "and diagonal bend by 32 segments, clamp, damping, compensated sums. Bare: neither "
        "damping nor compensation. Plain: the scalar double solver that the kernels are held to. "
        "Frames of 61 substeps, as the paper's experiments have at 1/60 s; what a frame takes at "
        "its end is among the time.");
    const std::vector<std::pair<std::string, std::string>> kinds = {
        {"substep/{}/float/AVX-512/1", "AVX-512, single"},
        {"substep_bare/{}/float/AVX-512/1", "AVX-512, single, bare"},
        {"substep/{}/double/AVX-512/1", "AVX-512, double"},
        {"substep/{}/float/AVX2/1", "AVX2, single"},
        {"substep_bare/{}/float/AVX2/1", "AVX2, single, bare"},
        {"substep/{}/double/AVX2/1", "AVX2, double"},
        {"substep/{}/float/AVX-512/2", "AVX-512, single, two threads"},
        {"substep/{}/double/plain/1/LINEARIZED", "plain, LINEARIZED"},
        {"substep/{}/double/plain/1/SERIES", "plain, SERIES"},
        {"substep/{}/double/plain/1/EXACT", "plain, EXACT"}};
    const std::vector<std::string> sizes = {"31x31", "101x101", "317x317", "1000x1000"};
    Cells columns = {"solver"};
    columns.insert(columns.end(), sizes.begin(), sizes.end());
    std::vector<Cells> rows;
    for (const auto& [pattern, title] : kinds) {
      Cells row = {title};
      for (const std::string& size : sizes) {
        const Run* run = find(fmt::format(fmt::runtime(pattern), size));
        row.push_back(run ? fmt::format("{:.1f}", 1e-6 * run->items) : "");
      }
      rows.push_back(row);
    }
    page_.table(columns, rows);

    std::vector<Cells> ratios;
    const auto ratio = [&](const std::string& title, const std::string& slow,
                           const std::string& fast) {
      Cells row = {title};
      for (const std::string& size : sizes)
        row.push_back(times(find(fmt::format(fmt::runtime(slow), size)),
                            find(fmt::format(fmt::runtime(fast), size))));
      ratios.push_back(row);
    };
    const std::string fastest = kinds[0].first;
    ratio("plain, SERIES / AVX-512, single", kinds[8].first, fastest);
    ratio("plain, LINEARIZED / AVX-512, single", kinds[7].first, fastest);
    ratio("AVX2 / AVX-512, single", kinds[3].first, fastest);
    ratio("double / single, AVX-512", kinds[2].first, fastest);
    ratio("one thread / two", fastest, kinds[6].first);
    columns[0] = "ratio of times";
    page_.table(columns, ratios);
  }

  void memory() {
    page_.text("## Memory");
    for (const char* size : {"31x31", "101x101"})
      if (const Run* run = find(fmt::format("memory/{}/iterations:1", size)))
        page_.text(
            fmt::format("A simulation of {} particles holds {:.0f} KiB, packed for a pause {:.0f}.",
                        size, run->bytes / 1024, run->bytes_packed / 1024));
  }

  Page page_;
  std::map<std::string, Run> runs_;
};

}  // namespace

void speed(const std::filesystem::path& folder, const std::string& commit, bool /*large*/) {
  SpeedPage(folder, commit).write();
}

}  // namespace weft::reports
