#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

#include "server/config.h"
#include "server/server.h"

namespace {

constexpr unsigned kMostDraining = 8;  // s; systemd and docker wait 10 before they kill

// Waits for one of the signals. systemd hears meanwhile that the server answers, if it wants to.
int await(const sigset_t& signals, weft::Server& server) {
  std::uint64_t patience_us = 0;
  int signal = 0;
  if (sd_watchdog_enabled(0, &patience_us) <= 0) {
    sigwait(&signals, &signal);
    return signal;
  }
  const std::chrono::microseconds turn(patience_us / 3);
  const auto seconds = std::chrono::floor<std::chrono::seconds>(turn);
  const timespec pause{seconds.count(), std::chrono::nanoseconds(turn - seconds).count()};
  while ((signal = sigtimedwait(&signals, nullptr, &pause)) < 0)
    if (server.answers(std::chrono::ceil<std::chrono::milliseconds>(turn)))
      sd_notify(0, "WATCHDOG=1");
  return signal;
}

// Takes the end of standard input for a signal.
void watch_input() {
  std::thread([] {
    std::array<char, 256> ignored{};
    ssize_t count = 0;
    while ((count = read(STDIN_FILENO, ignored.data(), ignored.size())) > 0 ||
           (count < 0 && errno == EINTR)) {
    }
    kill(getpid(), SIGTERM);
  }).detach();
}

int serve(const weft::Config& config) {
  // blocked before there are threads, so that none but this one takes them
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  if (config.until_eof) watch_input();

  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error like a full disk

  spdlog::set_default_logger(spdlog::stderr_logger_mt("weftd"));
  spdlog::set_level(spdlog::level::from_str(config.log_level));

  weft::Server server(config.server);
  std::printf("weftd listening on %s\n", server.address().c_str());
  std::fflush(stdout);
  if (config.server.metrics) spdlog::info("metrics at http://{}/metrics", server.metrics_address());
  spdlog::info("version {}, {} workers", WEFT_VERSION, config.server.worker_threads);

  sd_notify(0, "READY=1");
  const int signal = await(signals, server);
  sd_notify(0, "STOPPING=1");
  alarm(kMostDraining);
  spdlog::info("{}: draining", signal == SIGINT ? "SIGINT" : "SIGTERM");
  server.stop();
  spdlog::info("stopped");
  spdlog::shutdown();
  std::_Exit(0);  // a frame that is being computed is not waited for: nobody will see it
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return serve(weft::read_config(argc, argv));
  } catch (const weft::ConfigExit& exit) {
    std::fputs(exit.text.c_str(), exit.code == 0 ? stdout : stderr);
    return exit.code;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "weftd: %s\n", error.what());
    return 1;
  }
}
