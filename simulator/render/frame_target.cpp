#include "frame_target.h"

#include <string>

namespace nido::sim {
namespace {

Status checkFrame(const std::string& what, int width, int height) {
  const GLenum state = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  if (state == GL_FRAMEBUFFER_COMPLETE && glGetError() == GL_NO_ERROR) return {};
  return Error{ErrorCode::kFailed, "cameras: the OpenGL library gives no " + what + " buffer of " +
                                       std::to_string(width) + "x" + std::to_string(height) + " (state " +
                                       std::to_string(state) + "); too little memory?"};
}

void makeBuffer(GLuint buffer, int samples, GLenum format, int width, int height, GLenum attachment) {
  glBindRenderbuffer(GL_RENDERBUFFER, buffer);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples > 1 ? samples : 0, format, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
}

}  // namespace

Result<ColourTarget> ColourTarget::create(int width, int height, int samples) {
  ColourTarget target;
  target.width_ = width;
  target.height_ = height;
  target.samples_ = samples;
  glGenFramebuffers(1, &target.draw_frame_);
  glGenRenderbuffers(3, target.buffers_);
  glBindFramebuffer(GL_FRAMEBUFFER, target.draw_frame_);
  makeBuffer(target.buffers_[0], samples, GL_RGBA8, width, height, GL_COLOR_ATTACHMENT0);
  // as floats, which the software renderer need not convert
  makeBuffer(target.buffers_[1], samples, GL_DEPTH_COMPONENT32F, width, height, GL_DEPTH_ATTACHMENT);
  if (Status ok = checkFrame("colour", width, height); !ok) {
    target.clear();
    return ok.error();
  }
  if (samples > 1) {
    glGenFramebuffers(1, &target.read_frame_);
    glBindFramebuffer(GL_FRAMEBUFFER, target.read_frame_);
    makeBuffer(target.buffers_[2], 1, GL_RGBA8, width, height, GL_COLOR_ATTACHMENT0);
    if (Status ok = checkFrame("colour", width, height); !ok) {
      target.clear();
      return ok.error();
    }
  }
  return target;
}

void ColourTarget::clear() {
  glDeleteFramebuffers(1, &draw_frame_);
  glDeleteFramebuffers(1, &read_frame_);
  glDeleteRenderbuffers(3, buffers_);
}

void ColourTarget::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, draw_frame_);
  glViewport(0, 0, width_, height_);
}

void ColourTarget::read(unsigned char* rgb) const {
  if (samples_ > 1) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, draw_frame_);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, read_frame_);
    glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, read_frame_);
  } else {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, draw_frame_);
  }
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, rgb);
}

Result<IdTarget> IdTarget::create(int width, int height) {
  IdTarget target;
  target.width_ = width;
  target.height_ = height;
  glGenFramebuffers(1, &target.frame_);
  glGenRenderbuffers(3, target.buffers_);
  glBindFramebuffer(GL_FRAMEBUFFER, target.frame_);
  makeBuffer(target.buffers_[0], 1, GL_R32F, width, height, GL_COLOR_ATTACHMENT0);
  makeBuffer(target.buffers_[1], 1, GL_R32UI, width, height, GL_COLOR_ATTACHMENT1);
  makeBuffer(target.buffers_[2], 1, GL_DEPTH_COMPONENT32F, width, height, GL_DEPTH_ATTACHMENT);
  const GLenum attachments[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glDrawBuffers(2, attachments);
  if (Status ok = checkFrame("depth", width, height); !ok) {
    target.clear();
    return ok.error();
  }
  return target;
}

void IdTarget::clear() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteRenderbuffers(3, buffers_);
}

void IdTarget::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, width_, height_);
}

void IdTarget::read(float* z_m, GLuint* instance) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, width_, height_, GL_RED, GL_FLOAT, z_m);
  glReadBuffer(GL_COLOR_ATTACHMENT1);
  glReadPixels(0, 0, width_, height_, GL_RED_INTEGER, GL_UNSIGNED_INT, instance);
}

Result<ShadowTarget> ShadowTarget::create(int size) {
  ShadowTarget target;
  target.size_ = size;
  glGenTextures(1, &target.texture_);
  glBindTexture(GL_TEXTURE_2D, target.texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, size, size, 0, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT,
               nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  // outside the map everything is lit
  const float far_away[] = {1, 1, 1, 1};
  glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, far_away);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glGenFramebuffers(1, &target.frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, target.frame_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, target.texture_, 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  if (Status ok = checkFrame("shadow", size, size); !ok) {
    target.clear();
    return ok.error();
  }
  return target;
}

void ShadowTarget::clear() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteTextures(1, &texture_);
}

void ShadowTarget::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, size_, size_);
}

}  // namespace nido::sim
