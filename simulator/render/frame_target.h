#pragma once

#include "gl.h"
#include "nido/interfaces/result.h"

namespace nido::sim {

// Where a picture of one size is drawn. Owns its GL objects; create and clear() want the context in use.
class ColourTarget {
 public:
  static Result<ColourTarget> create(int width, int height, int samples);
  void clear();

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  // Binds what is drawn to.
  void bind() const;
  // Averages the samples and reads width x height x 3 bytes, first GL row first.
  void read(unsigned char* rgb) const;

 private:
  int width_ = 0;
  int height_ = 0;
  int samples_ = 1;
  GLuint draw_frame_ = 0;
  GLuint read_frame_ = 0;
  GLuint buffers_[3] = {0, 0, 0};  // colour, depth, resolved colour
};

// The same for depth and instance ids.
class IdTarget {
 public:
  static Result<IdTarget> create(int width, int height);
  void clear();

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  void bind() const;
  void read(float* z_m, GLuint* instance) const;

 private:
  int width_ = 0;
  int height_ = 0;
  GLuint frame_ = 0;
  GLuint buffers_[3] = {0, 0, 0};  // z, id, depth
};

// A square depth map seen from the lamp.
class ShadowTarget {
 public:
  static Result<ShadowTarget> create(int size);
  void clear();

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] GLuint texture() const { return texture_; }
  void bind() const;

 private:
  int size_ = 0;
  GLuint frame_ = 0;
  GLuint texture_ = 0;
};

}  // namespace nido::sim
