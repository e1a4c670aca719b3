#include "tests/support/service/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

namespace weft::testing {

Process::Process(const std::string& program, const std::vector<std::string>& arguments,
                 const std::string& output, std::size_t file_size_limit,
                 std::vector<std::string> environment) {
  std::string path = program.starts_with('/') ? program : std::string(WEFT_BIN_DIR) + '/' + program;
  std::vector<std::string> words = arguments;
  words.insert(words.begin(), path);
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::vector<char*> envp;
  for (auto& variable : environment) envp.push_back(variable.data());
  for (char** variable = environ; *variable != nullptr; ++variable) envp.push_back(*variable);
  envp.push_back(nullptr);
  const int out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);

  pid_ = ::fork();
  if (pid_ < 0 || out < 0) throw std::runtime_error("cannot start " + path);
  if (pid_ == 0) {
    ::dup2(out, STDOUT_FILENO);
    ::dup2(out, STDERR_FILENO);
    const rlimit limit{.rlim_cur = file_size_limit, .rlim_max = file_size_limit};
    if (file_size_limit > 0) ::setrlimit(RLIMIT_FSIZE, &limit);
    ::execve(argv[0], argv.data(), envp.data());
    ::_exit(127);
  }
  ::close(out);
}

Process::~Process() {
  if (pid_ < 0) return;
  signal(SIGKILL);
  wait();
}

void Process::signal(int number) const { ::kill(pid_, number); }

int Process::wait() {
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace weft::testing
