#include "nido/simulator/render/renderer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "draw_list.h"
#include "frame_target.h"
#include "gl.h"
#include "scene_geometry.h"
#include "shaders.h"
#include "textures.h"

namespace nido::sim {
namespace {

// What the shadow map covers: a ball around robot and table.
const Eigen::Vector3d kShadowCentre_World_m(-0.15, 0.0, -0.08);
constexpr double kShadowRadius_m = 0.95;
// nearer to the lamp than the ball there may still be an arm that throws its shadow into it
constexpr double kShadowDepth_m = 1.4;
constexpr double kShadowBias_m = 0.0015;  // where two solids share a face, none shades the other
constexpr std::size_t kMaxTargets = 4;    // sizes of pictures whose buffers are kept

// The light of a normal room, linear; Lighting scales it.
const Eigen::Vector3f kKeyColour(0.74F, 0.72F, 0.68F);
const Eigen::Vector3f kFillColour(0.16F, 0.17F, 0.19F);
const Eigen::Vector3f kSkyColour(0.42F, 0.43F, 0.45F);
const Eigen::Vector3f kGroundColour(0.24F, 0.23F, 0.22F);
const Eigen::Vector3f kFillDirection = Eigen::Vector3f(-0.7F, 0.6F, 0.25F).normalized();

Eigen::Matrix4d inverse(const Eigen::Isometry3d& X) { return X.inverse().matrix(); }

// Clip coordinates of a pinhole. Image rows run downwards and so do the rows in memory: v grows with the GL
// row, which mirrors the picture and so turns the sense of front faces.
Eigen::Matrix4d clipFromWorld(const Camera& camera) {
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  P(0, 0) = 2 * camera.fx_px / camera.width;
  P(0, 2) = 2 * camera.cx_px / camera.width - 1;
  P(1, 1) = 2 * camera.fy_px / camera.height;
  P(1, 2) = 2 * camera.cy_px / camera.height - 1;
  P(2, 2) = (camera.far_m + camera.near_m) / (camera.far_m - camera.near_m);
  P(2, 3) = -2 * camera.far_m * camera.near_m / (camera.far_m - camera.near_m);
  P(3, 2) = 1;
  return P * inverse(camera.X_WorldCamera);
}

Eigen::Matrix4d clipFromWorldOfLamp(const Eigen::Vector3d& towards_lamp) {
  const Eigen::Vector3d z = -towards_lamp.normalized();
  const Eigen::Vector3d helper = std::abs(z.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d x = z.cross(helper).normalized();
  Eigen::Isometry3d X_WorldLamp = Eigen::Isometry3d::Identity();
  X_WorldLamp.linear() << x, z.cross(x), z;
  X_WorldLamp.translation() = kShadowCentre_World_m;
  Eigen::Matrix4d scale = Eigen::Matrix4d::Identity();
  scale.diagonal() << 1 / kShadowRadius_m, 1 / kShadowRadius_m, 1 / kShadowDepth_m, 1;
  return scale * inverse(X_WorldLamp);
}

struct Program {
  GLuint id = 0;
  [[nodiscard]] GLint at(const char* name) const { return glGetUniformLocation(id, name); }
  void set(const char* name, const Eigen::Matrix4d& M) const {
    const Eigen::Matrix4f values = M.cast<float>();
    glUniformMatrix4fv(at(name), 1, GL_FALSE, values.data());
  }
  void set(const char* name, const Eigen::Vector3f& v) const { glUniform3f(at(name), v.x(), v.y(), v.z()); }
  void set(const char* name, float x) const { glUniform1f(at(name), x); }
  void set(const char* name, int x) const { glUniform1i(at(name), x); }
};

}  // namespace

class Renderer::Impl {
 public:
  Impl(const RenderOptions& options, GlContext context)
      : options_(options), context_(std::move(context)), geometry_(options.room) {}
  ~Impl();

  Status setUp();
  Status setScene(const SceneSnapshot& scene);
  Status setLighting(const Lighting& lighting);
  Status render(const Camera& camera, Image& picture);
  Status renderDepth(const Camera& camera, DepthImage& picture);

 private:
  Status makePatterns();
  void makeVertexArray();
  void drawShadows();
  void setLightOf(const Program& program, const Camera& camera, const Eigen::Matrix4d& clip_from_world) const;
  template <class Target, class Make>
  Result<Target*> targetOf(std::vector<Target>& targets, const Camera& camera, Make make);
  static Status finish(const char* what);

  RenderOptions options_;
  GlContext context_;
  SceneGeometry geometry_;
  Lighting lighting_;
  bool shadows_current_ = false;
  Eigen::Matrix4d lamp_clip_from_world_ = Eigen::Matrix4d::Identity();
  DrawList list_;

  Program plain_;
  Program textured_;
  Program shadow_;
  Program id_;
  GLuint vertex_array_ = 0;
  GLuint vertex_buffer_ = 0;
  GLuint index_buffer_ = 0;
  GLuint patterns_ = 0;
  std::vector<ShadowTarget> shadow_target_;   // one
  std::vector<ColourTarget> colour_targets_;  // the least recently used first
  std::vector<IdTarget> id_targets_;
};

Renderer::Impl::~Impl() {
  const GlContext::Use use(context_);
  if (!use.ok()) return;
  for (ColourTarget& target : colour_targets_) target.clear();
  for (IdTarget& target : id_targets_) target.clear();
  for (ShadowTarget& target : shadow_target_) target.clear();
  for (const Program& program : {plain_, textured_, shadow_, id_}) glDeleteProgram(program.id);
  glDeleteBuffers(1, &vertex_buffer_);
  glDeleteBuffers(1, &index_buffer_);
  glDeleteVertexArrays(1, &vertex_array_);
  glDeleteTextures(1, &patterns_);
}

Status Renderer::Impl::setUp() {
  const GlContext::Use use(context_);
  if (!use.ok()) return Error{ErrorCode::kFailed, "cameras: the off-screen OpenGL context cannot be used"};
  struct Wanted {
    Program* program;
    const char* name;
    std::string vertex;
    std::string fragment;
  };
  for (const Wanted& wanted : {Wanted{&plain_, "plain", litVertexShader(false), litFragmentShader(false)},
                               Wanted{&textured_, "textured", litVertexShader(true), litFragmentShader(true)},
                               Wanted{&shadow_, "shadow", shadowVertexShader(), shadowFragmentShader()},
                               Wanted{&id_, "id", idVertexShader(), idFragmentShader()}}) {
    Result<GLuint> program = makeProgram(wanted.name, wanted.vertex, wanted.fragment);
    if (!program) return program.error();
    wanted.program->id = *program;
  }
  Result<ShadowTarget> shadow = ShadowTarget::create(options_.shadow_map_size);
  if (!shadow) return shadow.error();
  shadow_target_.push_back(*shadow);
  if (Status ok = makePatterns(); !ok) return ok;
  makeVertexArray();
  glEnable(GL_DEPTH_TEST);
  glFrontFace(GL_CW);  // see clipFromWorld
  glCullFace(GL_BACK);
  glEnable(GL_MULTISAMPLE);
  return finish("start");
}

Status Renderer::Impl::makePatterns() {
  const std::vector<TexturePattern>& patterns = texturePatterns();
  glGenTextures(1, &patterns_);
  glBindTexture(GL_TEXTURE_2D_ARRAY, patterns_);
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_R8, kTextureSize, kTextureSize,
               static_cast<GLsizei>(patterns.size()), 0, GL_RED, GL_UNSIGNED_BYTE, nullptr);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const std::vector<std::uint8_t> texels = patterns[i].make();
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, static_cast<GLint>(i), kTextureSize, kTextureSize, 1,
                    GL_RED, GL_UNSIGNED_BYTE, texels.data());
  }
  glGenerateMipmap(GL_TEXTURE_2D_ARRAY);
  // one level a pixel: blending two costs a tenth of the whole picture, and the patterns are weak
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return finish("textures");
}

void Renderer::Impl::makeVertexArray() {
  glGenVertexArrays(1, &vertex_array_);
  glGenBuffers(1, &vertex_buffer_);
  glGenBuffers(1, &index_buffer_);
  glBindVertexArray(vertex_array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertex_buffer_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffer_);
  const auto at = [](std::size_t offset) { return reinterpret_cast<const void*>(offset); };
  constexpr GLsizei kStride = sizeof(GpuVertex);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, at(offsetof(GpuVertex, p_m)));
  glVertexAttribPointer(1, 4, GL_SHORT, GL_TRUE, kStride, at(offsetof(GpuVertex, normal_shininess)));
  glVertexAttribPointer(2, 4, GL_UNSIGNED_SHORT, GL_TRUE, kStride, at(offsetof(GpuVertex, colour)));
  glVertexAttribPointer(3, 3, GL_FLOAT, GL_FALSE, kStride, at(offsetof(GpuVertex, texture)));
  glVertexAttribIPointer(4, 1, GL_UNSIGNED_INT, kStride, at(offsetof(GpuVertex, id)));
  for (GLuint i = 0; i < 5; ++i) glEnableVertexAttribArray(i);
}

Status Renderer::Impl::finish(const char* what) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return {};
  return Error{ErrorCode::kFailed,
               std::string("cameras: OpenGL error ") + std::to_string(error) + " (" + what + ")"};
}

Status Renderer::Impl::setScene(const SceneSnapshot& scene) {
  Result<SceneGeometry::Change> change = geometry_.update(scene);
  if (!change) return change.error();
  if (*change == SceneGeometry::Change::kNone) return {};
  const GlContext::Use use(context_);
  if (!use.ok()) return Error{ErrorCode::kFailed, "cameras: the off-screen OpenGL context cannot be used"};
  shadows_current_ = false;
  const std::vector<GpuVertex>& vertices = geometry_.vertices();
  glBindVertexArray(vertex_array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertex_buffer_);
  if (*change == SceneGeometry::Change::kRebuilt) {
    const std::vector<std::uint32_t>& indices = geometry_.indices();
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(GpuVertex)),
                 vertices.data(), GL_DYNAMIC_DRAW);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)),
                 indices.data(), GL_STATIC_DRAW);
  } else {
    const auto [from, to] = geometry_.moved();
    glBufferSubData(GL_ARRAY_BUFFER, static_cast<GLintptr>(from * sizeof(GpuVertex)),
                    static_cast<GLsizeiptr>((to - from) * sizeof(GpuVertex)), vertices.data() + from);
  }
  return finish("scene");
}

Status Renderer::Impl::setLighting(const Lighting& lighting) {
  for (const auto& [name, value] :
       {std::pair{"brightness", lighting.brightness}, std::pair{"key", lighting.key},
        std::pair{"fill", lighting.fill}, std::pair{"ambient", lighting.ambient}}) {
    if (!std::isfinite(value) || value < 0) {
      return Error{ErrorCode::kInvalidArgument, std::string("lighting: ") + name + " is " +
                                                    std::to_string(value) +
                                                    ", expected zero or a positive number"};
    }
  }
  const Eigen::Vector3d& d = lighting.key_direction_World;
  if (!d.allFinite() || d.norm() < 1e-9) {
    return Error{ErrorCode::kInvalidArgument, "lighting: the direction to the key lamp has no length"};
  }
  lighting_ = lighting;
  shadows_current_ = false;
  return {};
}

void Renderer::Impl::drawShadows() {
  lamp_clip_from_world_ = clipFromWorldOfLamp(lighting_.key_direction_World);
  shadow_target_.front().bind();
  glClear(GL_DEPTH_BUFFER_BIT);
  if (lighting_.shadows) {
    list_.build(geometry_.pieces(), lamp_clip_from_world_, /*only_shadow=*/true);
    glUseProgram(shadow_.id);
    shadow_.set("u_clip_from_world", lamp_clip_from_world_);
    // the far sides of things throw the shadow, so that no surface shades itself
    glEnable(GL_CULL_FACE);
    glCullFace(GL_FRONT);
    list_.draw(Batch::kPlain);
    list_.draw(Batch::kTextured);
    glCullFace(GL_BACK);
    glDisable(GL_CULL_FACE);
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(2.0F, 4.0F);
    list_.draw(Batch::kTwoSided);
    list_.draw(Batch::kTwoSidedTextured);
    glDisable(GL_POLYGON_OFFSET_FILL);
  }
  shadows_current_ = true;
}

void Renderer::Impl::setLightOf(const Program& program, const Camera& camera,
                                const Eigen::Matrix4d& clip_from_world) const {
  Eigen::Matrix4d to_texture = Eigen::Matrix4d::Identity();
  to_texture.diagonal() << 0.5, 0.5, 0.5, 1;
  to_texture.topRightCorner<3, 1>().setConstant(0.5);
  to_texture(2, 3) -= kShadowBias_m / (2 * kShadowDepth_m);
  const auto scaled = [&](double factor, const Eigen::Vector3f& colour) {
    return Eigen::Vector3f(static_cast<float>(factor * lighting_.brightness) * colour);
  };
  program.set("u_clip_from_world", clip_from_world);
  program.set("u_shadow_from_world", Eigen::Matrix4d(to_texture * lamp_clip_from_world_));
  program.set("u_shadow_map", 0);
  program.set("u_two_sided", 0);
  program.set("u_eye", Eigen::Vector3f(camera.X_WorldCamera.translation().cast<float>()));
  program.set("u_key_direction", Eigen::Vector3f(lighting_.key_direction_World.normalized().cast<float>()));
  program.set("u_key", scaled(lighting_.key, kKeyColour));
  program.set("u_fill_direction", kFillDirection);
  program.set("u_fill", scaled(lighting_.fill, kFillColour));
  program.set("u_sky", scaled(lighting_.ambient, kSkyColour));
  program.set("u_ground", scaled(lighting_.ambient, kGroundColour));
}

template <class Target, class Make>
Result<Target*> Renderer::Impl::targetOf(std::vector<Target>& targets, const Camera& camera, Make make) {
  const auto known = std::find_if(targets.begin(), targets.end(), [&](const Target& target) {
    return target.width() == camera.width && target.height() == camera.height;
  });
  if (known != targets.end()) {
    std::rotate(known, known + 1, targets.end());
  } else {
    Result<Target> made = make();
    if (!made) return made.error();
    if (targets.size() == kMaxTargets) {
      targets.front().clear();
      targets.erase(targets.begin());
    }
    targets.push_back(*made);
  }
  return &targets.back();
}

Status Renderer::Impl::render(const Camera& camera, Image& picture) {
  if (Status ok = camera.check(); !ok) return ok;
  const GlContext::Use use(context_);
  if (!use.ok()) return Error{ErrorCode::kFailed, "cameras: the off-screen OpenGL context cannot be used"};
  Result<ColourTarget*> target = targetOf(colour_targets_, camera, [&] {
    return ColourTarget::create(camera.width, camera.height, options_.samples);
  });
  if (!target) return target.error();
  glBindVertexArray(vertex_array_);
  if (!shadows_current_) drawShadows();

  (*target)->bind();
  const auto grey = static_cast<float>(std::sqrt(std::min(1.0, 0.35 * lighting_.brightness)));
  glClearColor(grey, grey, grey, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, shadow_target_.front().texture());
  const Eigen::Matrix4d clip_from_world = clipFromWorld(camera);
  list_.build(geometry_.pieces(), clip_from_world, /*only_shadow=*/false);
  glUseProgram(plain_.id);
  setLightOf(plain_, camera, clip_from_world);
  glEnable(GL_CULL_FACE);
  list_.draw(Batch::kPlain);
  glDisable(GL_CULL_FACE);
  plain_.set("u_two_sided", 1);
  list_.draw(Batch::kTwoSided);
  if (!list_.empty(Batch::kTextured) || !list_.empty(Batch::kTwoSidedTextured)) {
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D_ARRAY, patterns_);
    glUseProgram(textured_.id);
    setLightOf(textured_, camera, clip_from_world);
    textured_.set("u_patterns", 1);
    const std::vector<TexturePattern>& patterns = texturePatterns();
    std::vector<float> strongest;
    for (const TexturePattern& pattern : patterns) strongest.push_back(pattern.strongest);
    glUniform1fv(textured_.at("u_strongest"), static_cast<GLsizei>(strongest.size()), strongest.data());
    textured_.set("u_two_sided", 1);
    list_.draw(Batch::kTwoSidedTextured);
    glEnable(GL_CULL_FACE);
    textured_.set("u_two_sided", 0);
    list_.draw(Batch::kTextured);
  }
  picture.width = camera.width;
  picture.height = camera.height;
  picture.rgb.resize(static_cast<std::size_t>(camera.width) * camera.height * 3);
  (*target)->read(picture.rgb.data());
  return finish("picture");
}

Status Renderer::Impl::renderDepth(const Camera& camera, DepthImage& picture) {
  if (Status ok = camera.check(); !ok) return ok;
  const GlContext::Use use(context_);
  if (!use.ok()) return Error{ErrorCode::kFailed, "cameras: the off-screen OpenGL context cannot be used"};
  Result<IdTarget*> target =
      targetOf(id_targets_, camera, [&] { return IdTarget::create(camera.width, camera.height); });
  if (!target) return target.error();
  glBindVertexArray(vertex_array_);
  (*target)->bind();
  const float no_depth[] = {0, 0, 0, 0};
  const GLuint no_instance[] = {0, 0, 0, 0};
  glClearBufferfv(GL_COLOR, 0, no_depth);
  glClearBufferuiv(GL_COLOR, 1, no_instance);
  glClear(GL_DEPTH_BUFFER_BIT);
  const Eigen::Matrix4d clip_from_world = clipFromWorld(camera);
  list_.build(geometry_.pieces(), clip_from_world, /*only_shadow=*/false);
  glUseProgram(id_.id);
  id_.set("u_clip_from_world", clip_from_world);
  glEnable(GL_CULL_FACE);
  list_.draw(Batch::kPlain);
  list_.draw(Batch::kTextured);
  glDisable(GL_CULL_FACE);
  list_.draw(Batch::kTwoSided);
  list_.draw(Batch::kTwoSidedTextured);
  picture.width = camera.width;
  picture.height = camera.height;
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  picture.z_m.resize(pixels);
  picture.instance.resize(pixels);
  (*target)->read(picture.z_m.data(), picture.instance.data());
  return finish("depth picture");
}

Result<Renderer> Renderer::create(const RenderOptions& options) {
  if (options.samples != 1 && options.samples != 4) {
    return Error{ErrorCode::kInvalidArgument,
                 "cameras: samples is " + std::to_string(options.samples) + ", expected 1 or 4"};
  }
  if (options.shadow_map_size < 64 || options.shadow_map_size > 4096) {
    return Error{
        ErrorCode::kInvalidArgument,
        "cameras: shadow_map_size is " + std::to_string(options.shadow_map_size) + ", expected 64 to 4096"};
  }
  Result<GlContext> context = GlContext::create();
  if (!context) return context.error();
  auto impl = std::make_unique<Impl>(options, std::move(*context));
  if (Status ok = impl->setUp(); !ok) return ok.error();
  if (Status ok = impl->setLighting(options.lighting); !ok) return ok.error();
  if (Status ok = impl->setScene({}); !ok) return ok.error();
  return Renderer(std::move(impl));
}

Renderer::Renderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Status Renderer::setScene(const SceneSnapshot& scene) { return impl_->setScene(scene); }
Status Renderer::setLighting(const Lighting& lighting) { return impl_->setLighting(lighting); }
Status Renderer::render(const Camera& camera, Image& picture) { return impl_->render(camera, picture); }
Status Renderer::renderDepth(const Camera& camera, DepthImage& picture) {
  return impl_->renderDepth(camera, picture);
}

}  // namespace nido::sim
