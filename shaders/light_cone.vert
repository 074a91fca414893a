#include "lib/view.glsl"
#include "lib/light.glsl"

// A polyhedron that holds the cone of light out to its reach. corner.xy is a point of the unit disc: its direction is
// the azimuth, its length the fraction of the cone's angle; corner.z the fraction of the reach (0: the apex).
in vec3 corner;
flat out Light light;

uniform uint first_light;

// 32 sides of a regular polygon around the circle: tan of the angle grows by 1 / cos(pi / 32).
const float CIRCUMSCRIBED = 1.0048386;

// Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1).
mat2x3 basis_around(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat2x3(1.0 + s * n.x * n.x * a, s * b, -s * n.x, b, s + n.y * n.y * a, -n.y);
}

vec3 cone_corner(Light light) {
    float angle = atan(CIRCUMSCRIBED * sin(light.cone_angle), cos(light.cone_angle)) * length(corner.xy);
    vec2 azimuth = length(corner.xy) > 0.0 ? normalize(corner.xy) : vec2(1.0, 0.0);
    return (cos(angle) * light.axis + sin(angle) * (basis_around(light.axis) * azimuth)) * corner.z;
}

void main() {
    light = lights[first_light + uint(gl_InstanceID)];
    gl_Position = view.clip_from_relative * vec4(light.position + cone_corner(light) * light.reach, 1.0);
}
