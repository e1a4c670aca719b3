#pragma once

#include <memory>
#include <string>

#include "client/render/picture.h"

namespace weft::client {

// The picture as a WebP file. Throws std::runtime_error.
std::string webp(const Picture& picture);

// Pictures of one size, one after the other, again and again, as a WebP file.
class WebpAnimation {
 public:
  WebpAnimation(int width, int height, int milliseconds_each);
  ~WebpAnimation();
  WebpAnimation(const WebpAnimation&) = delete;
  WebpAnimation& operator=(const WebpAnimation&) = delete;

  // Throw std::runtime_error.
  void add(const Picture& picture);
  std::string finish();

 private:
  class Encoder;
  std::unique_ptr<Encoder> encoder_;
};

}  // namespace weft::client
