#include "server/store/store.h"

namespace weft {
namespace {

class NoStore final : public SessionStore {
 public:
  LeftBehind load() override { return {}; }
  void add(const KeptSession& /*session*/, const Request& /*creation*/) override {}
  std::optional<SessionSnapshot> snapshot(const std::string& /*uid*/,
                                          const SessionPast& /*past*/) override {
    return std::nullopt;
  }
  std::unique_ptr<SessionLog> log_of(const std::string& /*uid*/,
                                     std::int64_t /*entries*/) override {
    return std::make_unique<NoLog>();
  }
  void erase(const std::string& /*uid*/, const Request& /*deletion*/,
             const SessionLog::Written& written) override {
    written({});
  }
};

}  // namespace

std::unique_ptr<SessionStore> make_no_store() { return std::make_unique<NoStore>(); }

}  // namespace weft
