#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "client/commands/commands.h"
#include "client/output/text.h"
#include "client/problem.h"

namespace weft::client {
namespace {

constexpr std::size_t kNameColumn = 14;  // of a command, before what it does
constexpr std::size_t kOptionColumn = 30;

struct Topic {
  const char* name;
  const char* summary;
  const char* text;
};

constexpr std::array kTopics{
    Topic{"units", "Units, axes, and how to get from a laboratory's numbers to them",
          R"(Everything is SI: m, kg, s, N, J; a field carries its unit in its name, such as
spacing_m or areal_density_kg_per_m2. Angles of options are in degrees. A strain
is a fraction in JSON (0.05), and shown as 5 %.

A textile's measured values do not depend on the mesh:
  areal_density_kg_per_m2  1 g/m^2 = 1e-3
  tensile_*_n_per_m        N for each m of width, at a strain of 1;
                           force over extension: 490 N/m at 2 % = 24500
  shear_n_per_m            N/m per radian; 1 gf/(cm degree) (KES) = 56.2
  bend_rigidity_*_n_m      1 gf cm^2/cm (KES) = 9.807e-5, 1 uN m (FAST) = 1e-6
  air_drag_kg_per_m2_s     drag in N of each m^2 for each m/s of wind
Raw ones, the paper's, are of one particle or connection of one mesh:
particle_mass_kg, stretch_n_per_m, shear_n_per_m, bend_n_m2, clamp_n_per_m. The
paper's own unit of k_b (--bend of scene new) is 1e-4 N m^2.

Gravity is (0, -9.80665, 0) m/s^2 unless a scene says otherwise, so y is up. A
grid's columns follow each other along the warp, its rows along the weft; both
are counted from 0. Frame N is the state at N x frame_step_s of simulated time.
)"},
    Topic{"errors", "Exit codes, and errors as JSON for programs",
          R"(Errors are on stderr, one sentence; where several fields are to blame, a line
for each. Exit codes:
  0    done
  1    refused by the server, not to be had, or not as expected
  2    wrong command line
  3    no connection to the server
  4    a file cannot be read or written, or is damaged
  130  interrupted before its end (Ctrl-C)

With --json an error is one line on stderr, and stdout has answers alone:
  {"error": {"code": "INVALID_ARGUMENT", "reason": "FIELD_INVALID",
             "message": "...", "violations": [{"field": "...",
             "description": "..."}]}}
A field is one of a scene file or a script, an option, or a place in a mesh.
code is gRPC's. reason is what a program should look at: the server's, such as
SESSION_NOT_FOUND,
FRAME_EXPIRED, STEP_UNSTABLE (proto/weft/v1 names them), or the client's own:
USAGE, NO_CONNECTION, FILE_UNREADABLE, FILE_UNWRITABLE, FILE_MALFORMED,
FILE_DAMAGED, SCRIPT_FAILED, INTERRUPTED. Messages may change.

  weft session get drape --json 2>error.json || jq -r .error.reason error.json
)"},
    Topic{"scenes", "What a scene file holds, how it is made and checked",
          R"(A scene is what is simulated: sheets with their textiles, colliders, pins,
gravity and wind, settings of the solver. Its file is the protobuf JSON of
weft.v1.Scene (proto/weft/v1/scene.proto says what each field means, its unit,
bounds, and what it is when it is absent):
  {"sheets": [{"name": "sheet",
               "grid": {"rows": 31, "columns": 31, "spacing_m": 0.0333},
               "textile": {"preset": "wool_tropical"}}],
   "colliders": [{"sphere": {"center_m": {}, "radius_m": 0.3}}]}

  weft scene new --template sphere --textile denim_11oz -o scene.json
  weft scene new --mesh shirt.obj --pin border:top -o shirt.json
  weft scene check scene.json        every mistake, or step, cost and warnings
  weft textile list                  presets, and which of them lack numbers
  weft session create scene.json --id drape
  weft session get drape --json      the scene in it has every default filled in

A field that does not exist is an error with its line. NaN is refused.
)"},
    Topic{"garments", "Patterns, how they become sheets, and how these are put on",
          R"(A pattern file is the protobuf JSON of weft.v1.Pattern: panels and seams, in m.
A panel is a piece as it is cut:
  name       what seams call it
  edges      its outline, anticlockwise as seen from outside. Each begins where
             the one before ends; points_m has its end, after one or two control
             points of a curve, or with arc: true a point that an arc of a
             circle passes. label: what it is for, such as "waist"
  grain_rad  from the v axis to the warp
  placement  where it stands around the body before it is sewn; unplaced its u
             runs along x, its v along y, and its outside looks to +z
  textile    its own; else the sheet's
A seam joins a first_side and a second_side, each of runs of edges one after the
other: {"panel": "front", "edge": 1}, or with begin and end a part of that edge.
The second side runs against the first, as panels with the same side outward
do; same_direction turns one of them over. Of sides of two lengths the longer
one is gathered evenly. A dart is a notch whose sides are sewn. With fold_rad a
seam is pressed to an angle: 3 folds the panels outside on outside, -3 inside on
inside. So is a panel along lines inside it, its creases: {"points_m": [0.1, 0,
0.1, 0.3], "fold_rad": 3}, and with start_rad it is folded there when it is put
on, as pleats are (weft garment new pleated_skirt). A closed band, such as a
collar, does not turn over by itself: make it of two panels, and place them
folded.

  weft drape tshirt --size 40 -o tshirt.glb           put on, until it hangs
  weft garment new tshirt --size 40 -o tshirt.json    by the tape, or by size
  weft garment import pattern.json -o mine.json       of GarmentCode
  weft garment build mine.json                        what is noteworthy
  weft garment build mine.json --body form.obj -o scene.json

Both sides of a seam get equal numbers of particles, which are one from the
start, between both panels: triangles along seams begin stretched. Inside,
triangles are equilateral and lie along the grain; a panel that is symmetric
about u = constant has symmetric ones.

Scenes of garments have a dressing (proto/weft/v1/scene.proto): first seams
close, without weight and friction, from a start without strain; then weight
comes in. What has no shoulders is held up until it hangs: edges labelled
"waist" keep their height, or where there are none the highest border. What
starts less than --deflate inside a body gets out as that grows. Cloth that has
passed through cloth is led apart until 3 s later (untangle_s). Whether a drape
is good is its verdict:
  NOT_DRESSED  seams still close, or something is held
  NOT_AT_REST  the cloth still moves
  CLOTH_CUTS   edges pass through cloth
  INSIDE_BODY  particles are inside a body
  SLID_DOWN    what was held has come down by more than 30 mm, or a garment that
               nothing held by more than 150 mm
  BESIDE_BODY  a border of a garment goes around no part of a body: a sleeve is
               beside the arm, a strap beside the shoulder
  TOO_TIGHT    1 % of the cloth is strained by more than 10 %, and pulled by
               more than 30 N/m, or strained by more than 30 %: knits stretch
               where wovens do not
)"},
    Topic{"recordings", "Files that hold frames, and what can be done with them",
          R"(A recording holds frames of a session as they were streamed, to the bit, with
its scene: one SQLite file, usually *.weft, each frame with a checksum.

  weft record drape --run --until-rest -o drape.weft
  weft record scene.json --embedded --to 300 -o drape.weft   without a server

Recording goes on by itself after the network or the server went away, no frame
lost or doubled. Killed, or on a full disk, it leaves a file that can be read,
with all but the last half second. --encoding float64 keeps the solver's own
numbers, quantized rounds to 0.1 mm and takes a third to a tenth.

  info, verify     what it holds; whether all of it is as it was written
  diff             how far two lie apart, where, and whether they are bit-equal
  cut, join        frames of it; recordings of one session together
  replay           serves it as the live session that it was
  export           obj, pc2, mdd, gltf, vtk, usda, csv, for other tools
  view             a page that plays it, small enough to mail
  render           pictures, and turntables: PNG, WebP
  plot             energy, strain, speed and substeps over time
)"},
    Topic{"scripting", "Scripts in YAML, and weft in a shell's loops",
          R"(A script runs sessions from a file, for every combination of some values, and
holds them to what it expects (weft script --help has all steps):
  for: {k_b: [0, 0.1], segments: [5, 32]}
  steps:
    - create: {template: paper-3, bend: $k_b, segments: $segments}
    - record: {file: $case.weft}
    - run: {until_rest: true, until_time_s: 10}
    - expect: {at_rest: true, largest_strain: {max: 0.05}}
weft script FILE --dry-run checks everything, runs nothing; --junit is for CI.

In a shell every command answers in JSON with --json, and its exit code says
whether it is done (weft help errors):
  for k_b in 0 0.1 0.3; do
    weft scene new --template paper-3 --bend $k_b -o scene.json
    weft record scene.json --embedded --until-rest --json -o k_b-$k_b.weft
  done | jq -r '[.file, .largest_strain] | @tsv'
--embedded needs no server; with one, WEFT_SERVER names it for all commands.
)"},
    Topic{"python", "The package weft for Python, with frames as arrays of numpy",
          R"(It is the Debian package python3-weft, and build/release/python for pip.
weft.serve() starts a weftd that ends with the program; weft.connect(ADDRESS,
TOKEN) speaks to another, by default that of WEFT_SERVER and its like.

  import weft
  with weft.serve() as server:
      sheet = weft.Sheet.grid(31, 31, 1 / 30, weft.Textile.preset("denim_11oz"))
      ball = weft.Collider(weft.Sphere(0.3, center_m=(0.5, -0.4, 0.5)))
      session = server.create_session(weft.Scene([sheet], [ball]))
      session.run(until_rest=True)
      for frame in session.frames():
          frame.positions        # (n, 3), m

  weft.Scene.load(FILE)          a scene file
  session.set_textile(T, over=2) from one textile to another, within 2 s
  session.grab, drag, release    a hand
  server.restore(session.snapshot().name)  keeps it, and goes on from there
  session.view()                 the newest frame, for those who draw
  weft.open(FILE).positions(97)  a frame of a recording
  weft.aio                       the same, to be awaited
  weft.Error                     code, reason, violations (field, description)
)"},
    Topic{"blender", "Cloth of Blender's scenes, computed by Weft into a point cache",
          R"(The add-on is the Debian package blender-weft, or build/release/
weft_blender.zip for Blender's preferences; it needs the package weft in
Blender's Python (weft help python). It runs a weftd of its own, or asks one
that the preferences name.

In the tab Physics, panel Weft, an object is Cloth or Collision. A cloth has a
fabric of the server, a vertex group that is held, and a flat shape: as it lies,
or its UV map. Simulate computes from the scene's first frame to its last; one
may scrub, change the fabric and cancel meanwhile. Gravity, units and frames are
the scene's, and a force field Wind blows at its strength in m/s.

The modifier Mesh Cache shows the frames. They stay without Weft, in a folder
beside the file; those of a file that has not been saved are kept by Bake.

  bpy.ops.weft.simulate()        in a script: waits for the last frame
  weft export --format pc2       frames of a recording, for the same modifier
)"},
    Topic{"security", "Who may use a server, and how weft shows who it is",
          R"(weftd listens on loopback, unencrypted. Where other machines reach it, it wants
--tls-cert and --tls-key, or --insecure. With --tokens FILE whoever calls needs
a token; sessions are then those of the principal that made them, and others
can neither see nor use them. Admins use all.
  weft token ann -o ann.token >> tokens           the token; its hash for weftd
  weftd --host 0.0.0.0 --tls-cert weftd.crt --tls-key weftd.key --tokens tokens
  weft --server cloth.example.org:7311 --tls-ca weftd.crt \
      --token-file ann.token session list

WEFT_SERVER, WEFT_TLS_CA, WEFT_TLS_CERT, WEFT_TLS_KEY, WEFT_TOKEN_FILE and
WEFT_TOKEN stand for these options. weft sends no token unencrypted to another
machine. --tls-cert and --tls-key show a certificate, where weftd asks for one
with --tls-client-ca. Keep token files to their owner; weft token makes them so.

The page of weft serve has no password: whoever reaches its port drives the
sessions that weft serve may use. It listens on loopback, as weft replay does.
)"}};

const Topic* find_topic(const std::vector<std::string>& words) {
  const auto* found = std::find_if(kTopics.begin(), kTopics.end(), [&](const Topic& topic) {
    return words.size() == 1 && words[0] == topic.name;
  });
  return found == kTopics.end() ? nullptr : &*found;
}

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(kOptionColumn); }

  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    return wrapped(Formatter::make_help(app, std::move(name), mode));
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return fmt::format("  {:{}}{}\n", command->get_display_name(true), kNameColumn - 2,
                       command->get_description());
  }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> help_formatter() { return std::make_shared<HelpFormatter>(); }

std::string help_of(const CLI::App& app, const std::vector<std::string>& words) {
  if (const Topic* topic = find_topic(words)) return topic->text;
  const CLI::App* command = &app;
  std::string name = app.get_name();
  for (const std::string& word : words) {
    const auto below = command->get_subcommands({});
    const auto next = std::find_if(below.begin(), below.end(),
                                   [&](const CLI::App* each) { return each->get_name() == word; });
    if (next == below.end()) {
      throw usage_problem(fmt::format("there is no command or topic \"{}\"; weft --help lists them",
                                      fmt::join(words, " ")));
    }
    command = *next;
    name += ' ' + word;
  }
  return app.get_formatter()->make_help(command, name, CLI::AppFormatMode::Normal);
}

std::vector<std::string> help_topics() {
  std::vector<std::string> names;
  for (const Topic& topic : kTopics) names.emplace_back(topic.name);
  return names;
}

std::string topics_text() {
  std::string text = "Topics, such as weft help units:\n";
  for (const Topic& topic : kTopics)
    text += fmt::format("  {:{}}{}\n", topic.name, kNameColumn - 2, topic.summary);
  return text;
}

void add_help(CLI::App& app) {
  app.add_subcommand("help", "Show the help of a command or topic, such as: help scene new");
}

}  // namespace weft::client
