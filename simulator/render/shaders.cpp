#include "shaders.h"

namespace nido::sim {
namespace {

std::string header(bool textured) {
  return std::string("#version 330 core\n") + (textured ? "#define TEXTURED\n" : "");
}

}  // namespace

// Light is summed up at the vertices, where it is cheap: shapes are fine enough for that, and on the flat
// ones it is exact. Pixels add the shadow and the pattern.
std::string litVertexShader(bool textured) {
  return header(textured) + R"(
layout(location = 0) in vec3 a_p;
layout(location = 1) in vec4 a_normal_shininess;
layout(location = 2) in vec4 a_colour;
layout(location = 3) in vec3 a_texture;
uniform mat4 u_clip_from_world;
uniform mat4 u_shadow_from_world;
uniform vec3 u_eye;
uniform vec3 u_key_direction;
uniform vec3 u_key;
uniform vec3 u_fill_direction;
uniform vec3 u_fill;
uniform vec3 u_sky;
uniform vec3 u_ground;
uniform bool u_two_sided;
out vec3 v_soft;    // what the surface sends back of the light that throws no shadows
out vec3 v_key;     // and of the key lamp
out vec3 v_shadow;  // place in the shadow map
#ifdef TEXTURED
out vec2 v_uv;
flat out vec2 v_layer_strongest;
uniform float u_strongest[8];
#endif
void main() {
  gl_Position = u_clip_from_world * vec4(a_p, 1.0);
  v_shadow = (u_shadow_from_world * vec4(a_p, 1.0)).xyz;
  vec3 n = a_normal_shininess.xyz;
  vec3 towards_eye = u_eye - a_p;
  if (u_two_sided && dot(n, towards_eye) < 0.0) n = -n;
  float towards_key = max(dot(n, u_key_direction), 0.0);
  v_soft = a_colour.rgb * (mix(u_ground, u_sky, 0.5 + 0.5 * n.z) + u_fill * max(dot(n, u_fill_direction), 0.0));
  float shininess = a_normal_shininess.w * 128.0;
  vec3 half_way = normalize(u_key_direction + normalize(towards_eye));
  float gloss = shininess > 0.5 ? 0.012 * sqrt(shininess) * pow(max(dot(n, half_way), 0.0), 4.0 * shininess) : 0.0;
  v_key = u_key * (a_colour.rgb * towards_key + (towards_key > 0.0 ? gloss : 0.0));
#ifdef TEXTURED
  v_uv = a_texture.xy;
  v_layer_strongest = vec2(a_texture.z, u_strongest[int(a_texture.z)]);
#endif
}
)";
}

std::string litFragmentShader(bool textured) {
  return header(textured) + R"(
in vec3 v_soft;
in vec3 v_key;
in vec3 v_shadow;
#ifdef TEXTURED
in vec2 v_uv;
flat in vec2 v_layer_strongest;
uniform sampler2DArray u_patterns;
#endif
uniform sampler2DShadow u_shadow_map;
out vec4 o_colour;
void main() {
  vec3 colour = v_soft + v_key * texture(u_shadow_map, v_shadow);
#ifdef TEXTURED
  colour *= texture(u_patterns, vec3(v_uv, v_layer_strongest.x)).r * v_layer_strongest.y;
#endif
  // sRGB within 3 of 255 levels; exact powers and an sRGB frame buffer would cost more than all the rest
  colour = min(colour, vec3(1.0));
  o_colour = vec4(1.2138 * sqrt(colour) - 0.2022 * colour - 0.0184, 1.0);
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
