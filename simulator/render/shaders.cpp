#include "shaders.h"

namespace nido::sim {
namespace {

std::string header(bool textured) {
  return std::string("#version 330 core\n") + (textured ? "#define TEXTURED\n" : "");
}

}  // namespace

std::string litVertexShader(bool textured) {
  return header(textured) + R"(
layout(location = 0) in vec3 a_p;
layout(location = 1) in vec4 a_normal_shininess;
layout(location = 2) in vec4 a_colour;
layout(location = 3) in vec3 a_texture;
uniform mat4 u_clip_from_world;
uniform mat4 u_shadow_from_world;
out vec3 v_p;
out vec3 v_normal;
out vec3 v_shadow;
flat out vec4 v_colour_shininess;
#ifdef TEXTURED
out vec2 v_uv;
flat out float v_layer;
#endif
void main() {
  gl_Position = u_clip_from_world * vec4(a_p, 1.0);
  v_p = a_p;
  v_normal = a_normal_shininess.xyz;
  v_shadow = (u_shadow_from_world * vec4(a_p, 1.0)).xyz;
  v_colour_shininess = vec4(a_colour.rgb, a_normal_shininess.w * 128.0);
#ifdef TEXTURED
  v_uv = a_texture.xy;
  v_layer = a_texture.z;
#endif
}
)";
}

std::string litFragmentShader(bool textured) {
  return header(textured) + R"(
in vec3 v_p;
in vec3 v_normal;
in vec3 v_shadow;
flat in vec4 v_colour_shininess;
#ifdef TEXTURED
in vec2 v_uv;
flat in float v_layer;
uniform sampler2DArray u_patterns;
uniform float u_strongest[8];
#endif
uniform sampler2DShadow u_shadow_map;
uniform float u_shadow_texel;
uniform vec3 u_eye;
uniform vec3 u_key_direction;
uniform vec3 u_key;
uniform vec3 u_fill_direction;
uniform vec3 u_fill;
uniform vec3 u_sky;
uniform vec3 u_ground;
out vec4 o_colour;
void main() {
  vec3 n = normalize(v_normal);
  if (!gl_FrontFacing) n = -n;
  vec3 albedo = v_colour_shininess.rgb;
#ifdef TEXTURED
  albedo *= texture(u_patterns, vec3(v_uv, v_layer)).r * u_strongest[int(v_layer)];
#endif
  float towards_key = max(dot(n, u_key_direction), 0.0);
  // a softly lit edge: four places around the point, each of them interpolated
  float lit = texture(u_shadow_map, v_shadow + vec3(-u_shadow_texel, -0.5 * u_shadow_texel, 0.0)) +
              texture(u_shadow_map, v_shadow + vec3(0.5 * u_shadow_texel, -u_shadow_texel, 0.0)) +
              texture(u_shadow_map, v_shadow + vec3(u_shadow_texel, 0.5 * u_shadow_texel, 0.0)) +
              texture(u_shadow_map, v_shadow + vec3(-0.5 * u_shadow_texel, u_shadow_texel, 0.0));
  lit *= 0.25;
  vec3 light = mix(u_ground, u_sky, 0.5 + 0.5 * n.z) + u_key * (lit * towards_key) +
               u_fill * max(dot(n, u_fill_direction), 0.0);
  float shininess = v_colour_shininess.w;
  vec3 half_way = normalize(u_key_direction + normalize(u_eye - v_p));
  float gloss = shininess > 0.5 ? 0.012 * sqrt(shininess) * pow(max(dot(n, half_way), 0.0), 4.0 * shininess) : 0.0;
  o_colour = vec4(albedo * light + u_key * (gloss * lit), 1.0);
}
)";
}

std::string shadowVertexShader() {
  return header(false) + R"(
layout(location = 0) in vec3 a_p;
uniform mat4 u_clip_from_world;
void main() { gl_Position = u_clip_from_world * vec4(a_p, 1.0); }
)";
}

std::string shadowFragmentShader() {
  return header(false) + R"(
void main() {}
)";
}

std::string idVertexShader() {
  return header(false) + R"(
layout(location = 0) in vec3 a_p;
layout(location = 4) in uint a_id;
uniform mat4 u_clip_from_world;
out float v_z;
flat out uint v_id;
void main() {
  gl_Position = u_clip_from_world * vec4(a_p, 1.0);
  v_z = gl_Position.w;
  v_id = a_id;
}
)";
}

std::string idFragmentShader() {
  return header(false) + R"(
in float v_z;
flat in uint v_id;
layout(location = 0) out float o_z;
layout(location = 1) out uint o_id;
void main() {
  o_z = v_z;
  o_id = v_id;
}
)";
}

}  // namespace nido::sim
