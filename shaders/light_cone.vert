#include "lib/view.glsl"
#include "lib/light.glsl"

// A polyhedron that holds the cone of light out to its reach. corner.xy is a point of the unit disc: its direction is
// the azimuth, its length the fraction of the cone's angle; corner.z the fraction of the reach (0: the apex).
in vec3 corner;
flat out uint light_index;

uniform uint first_light;

// 32 sides of a regular polygon around the circle: tan of the angle grows by 1 / cos(pi / 32).
const float CIRCUMSCRIBED = 1.0048386;

vec3 cone_corner(Light light) {
    float angle = atan(CIRCUMSCRIBED * sin(light.cone_angle), cos(light.cone_angle)) * length(corner.xy);
    vec2 azimuth = length(corner.xy) > 0.0 ? normalize(corner.xy) : vec2(1.0, 0.0);
    vec3 bitangent = cross(light.axis, light.tangent);
    vec3 across = azimuth.x * light.tangent + azimuth.y * bitangent;
    return (cos(angle) * light.axis + sin(angle) * across) * corner.z;
}

void main() {
    light_index = first_light + uint(gl_InstanceID);
    Light light = lights[light_index];
    gl_Position = view.clip_from_relative * vec4(light.position + cone_corner(light) * light.reach, 1.0);
}
