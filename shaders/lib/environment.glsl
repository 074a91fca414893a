#include "lib/constants.glsl"
#include "lib/render_space.glsl"

uniform sampler2D sky;             // latitude-longitude, mipmapped
uniform mat3 sky_from_relative;
uniform vec3 sky_emission;         // scales the map
uniform vec3 irradiance_sh[9];     // of the map, by normal

// OpenEXR's layout: centre +Z, a quarter from the left +X, top +Y.
vec2 latlong(vec3 d) {
    return vec2(0.5 - atan(d.x, d.z) / (2.0 * PI), acos(clamp(d.y, -1.0, 1.0)) / PI);
}

vec3 sky_radiance(vec3 direction, float lod) {
    return render_from_rec709(sky_emission * textureLod(sky, latlong(sky_from_relative * direction), lod).rgb);
}

// Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps".
vec3 sky_irradiance(vec3 normal) {
    vec3 n = sky_from_relative * normal;
    vec3 e = 0.282095 * irradiance_sh[0];
    e += 0.488603 * (n.y * irradiance_sh[1] + n.z * irradiance_sh[2] + n.x * irradiance_sh[3]);
    e += 1.092548 * (n.x * n.y * irradiance_sh[4] + n.y * n.z * irradiance_sh[5] + n.x * n.z * irradiance_sh[7]);
    e += 0.315392 * (3.0 * n.z * n.z - 1.0) * irradiance_sh[6];
    e += 0.546274 * (n.x * n.x - n.y * n.y) * irradiance_sh[8];
    return render_from_rec709(sky_emission * max(e, 0.0));
}

// The mip whose texel is as wide as the reflected GGX lobe at half its energy: tan of the half vector's angle is alpha.
float lobe_lod(float alpha) {
    float texel = PI / float(textureSize(sky, 0).y);
    return max(log2(2.0 * atan(alpha) / texel), 0.0);
}
