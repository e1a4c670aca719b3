#include "client/figures/dress_forms.h"

namespace weft::client {

std::shared_ptr<const DressForm> DressForms::of(const Measures& measures) {
  const std::lock_guard lock(mutex_);
  for (const auto& [known, form] : made_)
    if (known == measures) return form;
  return made_.emplace_back(measures, std::make_shared<const DressForm>(make_dress_form(measures)))
      .second;
}

}  // namespace weft::client
