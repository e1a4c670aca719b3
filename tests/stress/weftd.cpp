#include "tests/stress/weftd.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

namespace weft::stress {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// The number behind a label of /proc/PID/status.
std::int64_t number_behind(const std::string& text, const std::string& label) {
  const std::size_t place = text.find(label);
  if (place == std::string::npos) throw std::runtime_error("no " + label + " in /proc");
  return std::stoll(text.substr(place + label.size()));
}

}  // namespace

Weftd::Weftd(std::vector<std::string> flags) : flags_(flags) {
  const auto id = static_cast<unsigned>(getpid());
  host_ = fmt::format("127.{}.{}.{}", 1 + (id >> 16) % 250, (id >> 8) & 255, 1 + (id & 255) % 250);
  start();
}

Weftd::~Weftd() = default;

void Weftd::start() {
  std::ofstream(path("disk")) << static_cast<char>(Disk::kGood);
  std::vector<std::string> flags{"--host",     host_,        "--port",      port_,
                                 "--data-dir", path("data"), "--log-level", "warn"};
  flags.insert(flags.end(), flags_.begin(), flags_.end());
  const std::string output = path("weftd.txt");
  const std::vector<std::string> environment{"LD_PRELOAD=" WEFT_BAD_DISK_LIBRARY,
                                             "WEFT_BAD_DISK=" + path("disk")};
  process_ = std::make_unique<testing::Process>("weftd", flags, output, 0, environment);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const std::string listening = "weftd listening on " + host_ + ":";
  for (;;) {
    const std::string text = text_of(output);
    const std::size_t line = text.find(listening);
    if (line != std::string::npos && text.find('\n', line) != std::string::npos) {
      port_ = std::to_string(number_behind(text, listening));
      return;
    }
    if (std::chrono::steady_clock::now() > deadline)
      throw std::runtime_error("weftd does not serve: " + text);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

std::unique_ptr<client::Connection> Weftd::connect(std::stop_token stop) const {
  return client::Connection::to(address(), std::move(stop));
}

Usage Weftd::usage() const {
  const std::filesystem::path proc = fmt::format("/proc/{}", process_->id());
  const std::string status = text_of(proc / "status");
  const std::string stat = text_of(proc / "stat");
  const std::string io = text_of(proc / "io");  // empty where the kernel keeps no account
  std::istringstream fields(stat.substr(stat.rfind(')') + 2));
  const std::vector<std::string> words{std::istream_iterator<std::string>(fields), {}};
  const double user_ticks = std::stod(words.at(11)), kernel_ticks = std::stod(words.at(12));
  const std::filesystem::directory_iterator files(proc / "fd");
  return {.cpu_s = (user_ticks + kernel_ticks) / static_cast<double>(sysconf(_SC_CLK_TCK)),
          .memory = 1024 * number_behind(status, "VmRSS:"),
          .most_memory = 1024 * number_behind(status, "VmHWM:"),
          .stored = io.empty() ? 0 : number_behind(io, "\nwrite_bytes:"),
          .threads = static_cast<int>(number_behind(status, "Threads:")),
          .files = static_cast<int>(std::distance(begin(files), end(files)))};
}

void Weftd::kill() {
  process_->signal(SIGKILL);
  process_->wait();
}

void Weftd::freeze() const { process_->signal(SIGSTOP); }

void Weftd::thaw() const { process_->signal(SIGCONT); }

void Weftd::set_disk(Disk disk) const {
  std::ofstream(path("disk"), std::ios::in) << static_cast<char>(disk);
}

int Weftd::terminate() {
  process_->signal(SIGTERM);
  return process_->wait();
}

}  // namespace weft::stress
