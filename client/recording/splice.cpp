#include "client/recording/splice.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "client/problem.h"
#include "client/recording/writer.h"

namespace weft::client {
namespace {

Problem refused(const std::string& reason, const std::string& message) {
  return {Exit::kRefused, "FAILED_PRECONDITION", reason, message};
}

void check_alike(const RecordingReader& a, const RecordingReader& b) {
  const auto fail = [&](const char* why) {
    throw refused("RECORDINGS_DIFFER", fmt::format("{} and {} {}", a.path(), b.path(), why));
  };
  if (a.header().uid() != b.header().uid()) fail("are of different sessions");
  v1::StreamHeader header = b.header();
  header.set_start_frame(a.header().start_frame());
  if (header.SerializeAsString() != a.header().SerializeAsString())
    fail("differ in what their frames hold");
  for (std::size_t sheet = 0; sheet < a.topology().size(); ++sheet)
    if (a.topology()[sheet].SerializeAsString() != b.topology()[sheet].SerializeAsString())
      fail("differ in the triangles of their sheets");
}

// Of all: a recorder may not have had them.
Assets assets_of(std::vector<RecordingReader>& recordings) {
  Assets assets;
  for (RecordingReader& recording : recordings) assets.merge(recording.assets());
  return assets;
}

// The recordings by their first frames, all of the range in them; narrows the range to what there
// is.
void order_by_frames(std::vector<RecordingReader>& recordings, FrameRange& range) {
  std::sort(recordings.begin(), recordings.end(),
            [](const auto& a, const auto& b) { return a.first_frame() < b.first_frame(); });
  range.first = std::max(range.first, recordings.front().first_frame());
  std::int64_t last = recordings.front().first_frame() - 1;
  for (const RecordingReader& recording : recordings) {
    const std::int64_t from = std::max(last + 1, range.first);
    const std::int64_t to = std::min(recording.first_frame() - 1, range.last);
    if (from <= to)
      throw refused("FRAMES_MISSING", fmt::format("no recording holds frames {} to {}", from, to));
    last = std::max(last, recording.last_frame());
  }
  range.last = std::min(range.last, last);
  if (range.first > range.last) {
    throw refused("FRAMES_MISSING", fmt::format("there are frames {} to {} only",
                                                recordings.front().first_frame(), last));
  }
}

// The frame from the first that holds it, if all that do hold the same.
v1::Frame read(std::vector<RecordingReader>& recordings, std::int64_t number) {
  const RecordingReader* first = nullptr;
  v1::Frame frame;
  for (RecordingReader& recording : recordings) {
    if (number < recording.first_frame() || number > recording.last_frame()) continue;
    v1::Frame found = recording.read(number);
    if (first != nullptr && found.SerializeAsString() != frame.SerializeAsString()) {
      throw refused("RECORDINGS_DIFFER", fmt::format("{} and {} differ in frame {}", first->path(),
                                                     recording.path(), number));
    }
    if (first != nullptr) continue;
    first = &recording;
    frame = std::move(found);
  }
  return frame;
}

}  // namespace

FrameRange splice(std::vector<RecordingReader>& recordings, const SpliceOrder& order,
                  const std::function<void(std::int64_t frame)>& progress) {
  for (const RecordingReader& recording : recordings) check_alike(recordings.front(), recording);
  FrameRange range = order.frames;
  order_by_frames(recordings, range);
  if (!order.replace && std::filesystem::exists(order.path))
    throw unwritable(order.path, "the file exists; --force replaces it");

  v1::StreamHeader header = recordings.front().header();
  header.set_start_frame(range.first);
  const std::string unfinished = order.path + ".part";
  try {
    RecordingWriter writer(unfinished, true, recordings.front().scene(), header,
                           recordings.front().topology(), assets_of(recordings));
    for (std::int64_t number = range.first; number <= range.last; ++number) {
      progress(number);
      writer.add(read(recordings, number));
    }
    writer.commit();
  } catch (...) {
    std::filesystem::remove(unfinished);
    throw;
  }
  std::filesystem::rename(unfinished, order.path);
  return range;
}

}  // namespace weft::client
