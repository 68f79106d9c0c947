#pragma once

// OpenGL 3.3 core as libOSMesa exports it; no other GL library may be linked beside it.
#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include <GL/osmesa.h>

#include <memory>
#include <string>

#include "nido/interfaces/result.h"

namespace nido::sim {

// An off-screen context of its own. It is current only while a Use lives, in that thread.
class GlContext {
 public:
  static Result<GlContext> create();

  class Use {
   public:
    explicit Use(GlContext& context);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    // False if the library refused.
    [[nodiscard]] bool ok() const { return ok_; }

   private:
    bool ok_ = false;
  };

 private:
  struct Destroy {
    void operator()(osmesa_context* context) const { OSMesaDestroyContext(context); }
  };
  // OSMesa wants some memory to draw to; pictures go to frame buffer objects instead
  static constexpr int kDummySize = 4;
  std::unique_ptr<osmesa_context, Destroy> context_;
  std::unique_ptr<unsigned char[]> dummy_;
};

// Compiles and links a program, or says what the compiler said. `name` is for the message. A context is in
// use.
Result<GLuint> makeProgram(const std::string& name, const std::string& vertex_source,
                           const std::string& fragment_source);

}  // namespace nido::sim
