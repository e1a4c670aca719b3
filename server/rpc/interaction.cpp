#include "server/rpc/interaction.h"

#include <algorithm>
#include <string>
#include <utility>

#include "server/convert/convert.h"
#include "server/convert/names.h"
#include "server/rpc/bytes.h"
#include "server/rpc/errors.h"
#include "server/rpc/session_service.h"

namespace weft {
namespace {

// A newer drag takes the place of one that waits, unless the hand has let go between the two.
void add(std::vector<Action>& actions, Action action) {
  const auto same = std::find_if(actions.rbegin(), actions.rend(), [&](const Action& each) {
    return each.name == action.name && each.particle == action.particle;
  });
  const auto drag = Action::Kind::kDrag;
  if (action.kind == drag && same != actions.rend() && same->kind == drag) {
    *same = std::move(action);
  } else {
    actions.push_back(std::move(action));
  }
}

// The caller knows one action a message: "action.drag" of "actions[2].drag".
grpc::Status to_status_of_stream(Refusal refusal, const Session& session) {
  for (Problem& problem : refusal.problems) {
    problem.field = "action" + problem.field.substr(problem.field.find(']') + 1);
  }
  if (refusal.text == "actions") refusal.text = "action";
  return to_status(refusal, session);
}

}  // namespace

grpc::Status Interactions::add(const std::shared_ptr<Interaction>& interaction) {
  std::lock_guard lock(mutex_);
  if (draining_) return errors::server_draining();
  interactions_.insert(interaction);
  return grpc::Status::OK;
}

void Interactions::remove(const std::shared_ptr<Interaction>& interaction) {
  std::lock_guard lock(mutex_);
  interactions_.erase(interaction);
}

void Interactions::drain() {
  std::set<std::shared_ptr<Interaction>> interactions;
  {
    std::lock_guard lock(mutex_);
    draining_ = true;
    interactions = interactions_;
  }
  for (const auto& interaction : interactions) interaction->drain();
}

void Interaction::start(const grpc::ServerContextBase& context) {
  std::unique_lock lock(mutex_);
  self_ = shared_from_this();
  auto admitted = backend_.admit(context);
  if (const auto* error = std::get_if<grpc::Status>(&admitted)) {
    end(*error);
  } else {
    caller_ = std::get<StreamCaller>(std::move(admitted));
    if (const auto status = interactions_.add(self_); !status.ok()) end(status);
  }
  act(lock);
}

void Interaction::drain() {
  std::unique_lock lock(mutex_);
  end(errors::server_draining());
  act(lock);
}

void Interaction::OnCancel() {
  std::unique_lock lock(mutex_);
  end(errors::cancelled());
  act(lock);
}

void Interaction::OnDone() {
  const auto self = std::move(self_);
  interactions_.remove(self);
}

void Interaction::OnReadDone(bool ok) {
  std::unique_lock lock(mutex_);
  reading_ = false;
  if (!ok) {
    // what waits is carried out first
    if (!ending_) ending_ = grpc::Status::OK;
  } else if (!ending_) {
    v1::InteractRequest request;
    const bool decoded = decode(request_, request);
    request_.Clear();
    if (!decoded) {
      end(errors::message_malformed("weft.v1.InteractRequest"));
    } else if (!session_) {
      begin(request);
    } else if (const auto status = take(request); !status.ok()) {
      end(status);
    }
  }
  act(lock);
}

void Interaction::begin(const v1::InteractRequest& first) {
  if (const auto found = find_here(backend_, caller_.caller, first.session(), "session"))
    return begin(*found, first);
  reading_ = true;
  find_elsewhere(backend_, caller_.caller, first.session(),
                 [self = shared_from_this(), first](const FoundSession& found) {
                   std::unique_lock lock(self->mutex_);
                   self->reading_ = false;
                   if (!self->ending_) self->begin(found, first);
                   self->act(lock);
                 });
}

void Interaction::begin(const FoundSession& found, const v1::InteractRequest& first) {
  if (const auto* error = std::get_if<grpc::Status>(&found)) return end(*error);
  session_ = std::get<std::shared_ptr<Session>>(found);
  hand_ = session_->new_hand();
  if (const auto status = take(first); !status.ok()) end(status);
}

void Interaction::OnWriteDone(bool ok) {
  std::unique_lock lock(mutex_);
  busy_ = false;
  if (!ok) end(errors::cancelled());
  act(lock);
}

grpc::Status Interaction::take(const v1::InteractRequest& request) {
  if (!request.session().empty() && id_of(request.session()) != session_->id()) {
    return errors::field_invalid(
        "session", "\"" + request.session() + "\" is another one than the stream began with");
  }
  if (request.sequence() <= sequence_) {
    return errors::field_invalid("sequence", std::to_string(request.sequence()) + " is not above " +
                                                 std::to_string(sequence_));
  }
  const auto action = to_action(request.action(), "action");
  if (const auto* problems = std::get_if<std::vector<Problem>>(&action)) {
    return errors::field_invalid(*problems);
  }
  waiting_.sequence = sequence_ = request.sequence();
  add(waiting_.actions, std::get<Action>(action));
  return grpc::Status::OK;
}

// Does what can be done now.
void Interaction::act(std::unique_lock<std::mutex>& lock) {
  if (letting_) return;
  if (!ending_ && !reading_ && waiting_.actions.size() < kMostWaiting) {
    reading_ = true;
    StartRead(&request_);
  }
  if (busy_) return;
  if (!waiting_.actions.empty()) {
    busy_ = true;
    Batch batch = std::exchange(waiting_, {});
    for (Action& action : batch.actions) {
      action.hand = hand_;
      holds_ = holds_ || action.kind == Action::Kind::kGrab;
    }
    const auto done = [self = shared_from_this(),
                       sequence = batch.sequence](const Outcome& outcome) {
      std::unique_lock locked(self->mutex_);
      if (const auto* refusal = std::get_if<Refusal>(&outcome)) {
        self->busy_ = false;
        self->end(to_status_of_stream(*refusal, *self->session_));
        return self->act(locked);
      }
      v1::InteractResponse response;
      response.set_sequence(sequence);
      response.set_applied_frame(std::get<Applied>(outcome).frame);
      self->response_ = encoded(response);
      self->StartWrite(&self->response_);
    };
    return submit(lock, std::move(batch.actions), done);
  }
  if (ending_) let_go(lock);
}

// `done` may be called before it returns.
void Interaction::submit(std::unique_lock<std::mutex>& lock, std::vector<Action> actions,
                         Done done) {
  const auto session = session_;
  lock.unlock();
  session->submit(Act{std::move(actions), {}, std::move(done)});
  lock.lock();
}

// Actions that wait are not carried out.
void Interaction::end(const grpc::Status& status) {
  waiting_ = {};
  if (!ending_ || ending_->ok()) ending_ = status;
}

void Interaction::let_go(std::unique_lock<std::mutex>& lock) {
  letting_ = true;
  if (!holds_) return Finish(*ending_);
  submit(lock, {{.kind = Action::Kind::kLetGo, .hand = hand_}},
         [self = shared_from_this(), status = *ending_](const Outcome&) { self->Finish(status); });
}

}  // namespace weft
