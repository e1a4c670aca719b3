#include "server/session/frame.h"

#include <utility>

namespace weft {

std::shared_ptr<const void> EncodingCache::get(const std::string& key,
                                               const std::function<Encoding()>& make) const {
  std::lock_guard lock(mutex_);
  if (const auto found = encodings_.find(key); found != encodings_.end()) return found->second;
  Encoding made = make();
  bytes_ += made.bytes;
  if (meter_) meter_->add(made.bytes);
  return encodings_.emplace(key, std::move(made.data)).first->second;
}

void EncodingCache::count_in(std::shared_ptr<ByteMeter> meter) const {
  std::lock_guard lock(mutex_);
  if (meter_) meter_->remove(bytes_);
  meter_ = std::move(meter);
  if (meter_) meter_->add(bytes_);
}

Deformation deformation_of(const Frame& frame) {
  if (frame.deformation) return *frame.deformation;
  if (!frame.meter) return {};
  return frame.meter->deformation(frame.scene, frame.positions, frame.time);
}

std::vector<double> pressures_of(const Frame& frame) {
  if (!frame.meter) return frame.pressures;
  return frame.meter->pressures(frame.scene, frame.positions, frame.time);
}

std::vector<double> clearances_of(const Frame& frame, const std::vector<double>& shown) {
  if (!frame.meter) return frame.clearances;
  return frame.meter->clearances(frame.scene, shown, frame.time);
}

}  // namespace weft
