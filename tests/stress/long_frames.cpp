#include <fmt/format.h>

#include <chrono>

#include "client/load/load.h"
#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

using Sessions = v1::SessionService::Stub;

// A frame of it has 860 000 substeps of 3600 particles and a slow law, and takes the better part of
// an hour.
v1::Scene endless_scene() {
  v1::Scene scene;
  v1::Sheet* sheet = scene.add_sheets();
  sheet->mutable_grid()->set_rows(60);
  sheet->mutable_grid()->set_columns(60);
  sheet->mutable_grid()->set_spacing_m(0.01);
  auto* raw = sheet->mutable_textile()->mutable_raw();
  raw->set_particle_mass_kg(1e-9);
  raw->set_stretch_n_per_m(1e4);
  raw->set_shear_n_per_m(1e4);
  sheet->mutable_bending()->mutable_choi_ko()->set_evaluator(v1::EVALUATOR_EXACT);
  sheet->add_pins()->add_particles(0);
  scene.mutable_solver()->set_frame_step_s(0.1);
  return scene;
}

}  // namespace

// How late 20 paced sessions are beside one that is in a frame all the time, against how late they
// are without it; and how soon that one pauses.
Outcome long_frames(Form form) {
  const Weftd weftd({"--max-frame-work", "10000000000"});
  const auto connection = weftd.connect();
  client::LoadOrder order{.scene = client::make_template("load", {})};
  order.sessions = 20;
  order.ramp = std::chrono::milliseconds(500);
  order.duration = std::chrono::milliseconds(form == Form::kShort ? 3000 : 30'000);
  const auto alone = client::apply_load(*connection, order);

  const std::string name = client::create_session(*connection, endless_scene()).name();
  v1::RunSessionRequest run;
  run.set_name(name);
  connection->call(&Sessions::RunSession, run);
  const auto beside = client::apply_load(*connection, order);

  v1::PauseSessionRequest pause;
  pause.set_name(name);
  const auto begin = std::chrono::steady_clock::now();
  connection->call(&Sessions::PauseSession, pause);
  const std::chrono::duration<double> paused = std::chrono::steady_clock::now() - begin;
  const std::int64_t frame = connection->get_session(name).frame();

  const double frame_s = 1 / order.rate_per_s;
  const double before = alone.frame.quantile(0.99), after = beside.frame.quantile(0.99);
  return {.figure = fmt::format(
              "{} frames of 20 sessions, {} lost or doubled; p99 lateness {}, {} without; the long "
              "frame paused within {}",
              beside.frames_received, beside.frames_lost + beside.frames_doubled,
              client::seconds_text(after), client::seconds_text(before),
              client::seconds_text(paused.count())),
          .hold = "0; a tenth of a frame later; 0.1 s",
          .counts = alone.clean() && beside.clean() && frame == 0,
          .bounds = after - before < 0.1 * frame_s && paused.count() < 0.1};
}

}  // namespace weft::stress
