#pragma once

#include "core/pattern/garment.h"
#include "server/convert/convert.h"
#include "weft/v1/garment.pb.h"

namespace weft {

// The garment that a request asks for, or everything that is wrong with it.
Converted<v1::BuildGarmentResponse> build_garment(const v1::BuildGarmentRequest& request);

}  // namespace weft
