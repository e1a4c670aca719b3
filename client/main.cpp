#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "client/weft.h"

namespace {

// Ctrl-C, or a terminal that closes, asks for an end; a second one takes it.
void wait_for_signals(sigset_t signals, std::stop_source stop) {
  int signal = 0;
  sigwait(&signals, &signal);
  stop.request_stop();
  sigwait(&signals, &signal);
  std::_Exit(128 + signal);
}

}  // namespace

int main(int argc, char** argv) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaddset(&signals, SIGHUP);  // nohup wants it ignored
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);                  // before any thread starts
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error to report
  std::stop_source stop;
  std::thread(wait_for_signals, signals, stop).detach();

  // an embedded server, and gRPC, say it in their answers
  spdlog::set_level(spdlog::level::off);
  setenv("GRPC_VERBOSITY", "NONE", 0);

  winsize size{};
  ioctl(STDOUT_FILENO, TIOCGWINSZ, &size);
  const weft::client::Terminal terminal{std::cout, std::cerr, isatty(STDOUT_FILENO) == 1,
                                        isatty(STDERR_FILENO) == 1, size.ws_col};
  return weft::client::run_weft({argv + 1, argv + argc}, terminal, stop.get_token());
}
