#include "gl.h"

#include <cstdlib>
#include <mutex>

namespace nido::sim {

Result<GlContext> GlContext::create() {
  // llvmpipe reads this when its first screen is made. Threads of its own gain little for pictures of this
  // size and make the time of a frame depend on the load of the machine; who sets the variable has a reason.
  static std::once_flag once;
  std::call_once(once, [] { setenv("LP_NUM_THREADS", "0", /*overwrite=*/0); });

  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_DEPTH_BITS,
                            0,
                            OSMESA_STENCIL_BITS,
                            0,
                            OSMESA_ACCUM_BITS,
                            0,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            3,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            3,
                            0};
  GlContext result;
  result.context_.reset(OSMesaCreateContextAttribs(attributes, nullptr));
  if (!result.context_) {
    return Error{ErrorCode::kNotFound,
                 "cameras: libOSMesa gives no OpenGL 3.3 core context; is the package libosmesa6 of Debian "
                 "12 installed?"};
  }
  result.dummy_ = std::make_unique<unsigned char[]>(kDummySize * kDummySize * 4);
  const Use use(result);
  if (!use.ok()) {
    return Error{ErrorCode::kFailed, "cameras: the off-screen OpenGL context cannot be made current"};
  }
  return result;
}

GlContext::Use::Use(GlContext& context)
    : ok_(OSMesaMakeCurrent(context.context_.get(), context.dummy_.get(), GL_UNSIGNED_BYTE, kDummySize,
                            kDummySize) == GL_TRUE) {}

GlContext::Use::~Use() { OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0); }

Result<GLuint> makeProgram(const std::string& name, const std::string& vertex_source,
                           const std::string& fragment_source) {
  const GLuint program = glCreateProgram();
  for (const auto& [kind, source] :
       {std::pair{GL_VERTEX_SHADER, &vertex_source}, std::pair{GL_FRAGMENT_SHADER, &fragment_source}}) {
    const GLuint shader = glCreateShader(static_cast<GLenum>(kind));
    const char* text = source->c_str();
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    GLint ok = GL_FALSE;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok != GL_TRUE) {
      char log[1024] = "";
      glGetShaderInfoLog(shader, sizeof log, nullptr, log);
      glDeleteShader(shader);
      glDeleteProgram(program);
      return Error{ErrorCode::kFailed,
                   "cameras: a shader of program '" + name + "' does not compile: " + log};
    }
    glAttachShader(program, shader);
    glDeleteShader(shader);  // with the program
  }
  glLinkProgram(program);
  GLint ok = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (ok != GL_TRUE) {
    char log[1024] = "";
    glGetProgramInfoLog(program, sizeof log, nullptr, log);
    glDeleteProgram(program);
    return Error{ErrorCode::kFailed, "cameras: program '" + name + "' does not link: " + log};
  }
  return program;
}

}  // namespace nido::sim
