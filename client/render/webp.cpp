#include "client/render/webp.h"

#include <webp/encode.h>
#include <webp/mux.h>

#include <new>
#include <stdexcept>

namespace weft::client {
namespace {

constexpr float kQuality = 85;  // of 100

WebPConfig config() {
  WebPConfig config;
  WebPConfigPreset(&config, WEBP_PRESET_PICTURE, kQuality);
  config.use_sharp_yuv = 1;  // letters stay clear
  return config;
}

// A picture as the encoder takes it.
class Imported {
 public:
  explicit Imported(const Picture& picture) {
    if (WebPPictureInit(&image_) == 0) throw std::runtime_error("libwebp is of another version");
    image_.use_argb = 1;
    image_.width = picture.width();
    image_.height = picture.height();
    if (WebPPictureImportRGB(&image_, picture.bytes(), 3 * picture.width()) == 0)
      throw std::bad_alloc();
  }
  ~Imported() { WebPPictureFree(&image_); }
  Imported(const Imported&) = delete;
  Imported& operator=(const Imported&) = delete;

  WebPPicture* get() { return &image_; }

 private:
  WebPPicture image_{};
};

}  // namespace

std::string webp(const Picture& picture) {
  Imported image(picture);
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  image.get()->writer = WebPMemoryWrite;
  image.get()->custom_ptr = &writer;
  const WebPConfig how = config();
  const bool done = WebPEncode(&how, image.get()) != 0;
  std::string file(reinterpret_cast<const char*>(writer.mem), done ? writer.size : 0);
  WebPMemoryWriterClear(&writer);
  if (!done) throw std::runtime_error("the picture cannot be encoded as WebP");
  return file;
}

class WebpAnimation::Encoder {
 public:
  Encoder(int width, int height, int milliseconds_each) : milliseconds_each_(milliseconds_each) {
    WebPAnimEncoderOptions options;
    WebPAnimEncoderOptionsInit(&options);
    encoder_ = WebPAnimEncoderNew(width, height, &options);
    if (encoder_ == nullptr) throw std::bad_alloc();
  }
  ~Encoder() { WebPAnimEncoderDelete(encoder_); }
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  void add(const Picture& picture) {
    Imported image(picture);
    const WebPConfig how = config();
    check(WebPAnimEncoderAdd(encoder_, image.get(), time_, &how));
    time_ += milliseconds_each_;
  }

  std::string finish() {
    check(WebPAnimEncoderAdd(encoder_, nullptr, time_, nullptr));
    WebPData data;
    WebPDataInit(&data);
    check(WebPAnimEncoderAssemble(encoder_, &data));
    std::string file(reinterpret_cast<const char*>(data.bytes), data.size);
    WebPDataClear(&data);
    return file;
  }

 private:
  void check(int done) {
    if (done == 0) throw std::runtime_error(WebPAnimEncoderGetError(encoder_));
  }

  WebPAnimEncoder* encoder_;
  int milliseconds_each_;
  int time_ = 0;  // of the next picture, ms
};

WebpAnimation::WebpAnimation(int width, int height, int milliseconds_each)
    : encoder_(std::make_unique<Encoder>(width, height, milliseconds_each)) {}

WebpAnimation::~WebpAnimation() = default;

void WebpAnimation::add(const Picture& picture) { encoder_->add(picture); }

std::string WebpAnimation::finish() { return encoder_->finish(); }

}  // namespace weft::client
