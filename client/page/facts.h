#pragma once

#include <vector>

#include "client/output/json.h"
#include "client/recording/cloth.h"
#include "client/recording/reader.h"
#include "client/recording/tally.h"

namespace weft::client {

// What the panel of a page says of a recording: [{"group", "rows": [[label, value with its
// unit]]}].
Json page_facts(const RecordingReader& recording, const std::vector<ClothMesh>& cloth,
                const Tally& tally);

}  // namespace weft::client
