#pragma once

#include "client/figures/dress_form.h"
#include "weft/v1/garment.pb.h"

namespace weft::client {

// To the knee, with a waistband.
v1::Pattern make_skirt(const DressForm& form);
v1::Pattern make_pleated_skirt(const DressForm& form);

}  // namespace weft::client
