#include "lib/records.glsl"
#include "lib/constants.glsl"

layout(std430, binding = 3) readonly buffer LightBlock { Light lights[]; };

const uint PROFILE_UNIFORM = 0u;
const uint PROFILE_COSINE = 1u;
const uint PROFILE_SINE = 2u;

// Does it shine from one direction everywhere? The reach of such lights is infinite.
bool is_distant(Light light) {
#if defined(VOLUME_QUAD)
    return true;
#elif defined(VOLUMES_MIXED)
    return light.reach > 3.0e38;
#else
    return false;
#endif
}

#ifdef SHAPED
const float NO_CONE = 2.0 * PI;

// By a cone or by focus; a profile of IES apart.
bool is_shaped(Light light) {
    return light.cone_angle < NO_CONE || light.focus > 0.0;
}

// UsdLuxShapingAPI: cone with softness, focus with tint; `cosine` is between the axis and the direction of emission.
vec3 shaping(Light light, float cosine, float sine) {
    float angle = atan(sine, cosine);
    float cone = angle <= light.cone_smooth_start ? 1.0 :
                 angle >= light.cone_angle ? 0.0 :
                 1.0 - smoothstep(light.cone_smooth_start, light.cone_angle, angle);
    float focus = light.focus > 0.0 ? pow(abs(cosine), light.focus) : 1.0;
    return cone * mix(light.focus_tint, vec3(1.0), focus);
}
#endif

#ifdef IES
uniform sampler2DArray ies_tables; // candela by horizontal and vertical angle, a layer a profile

const uint NO_IES = 0xffffffffu;

// UsdLuxShapingAPI's profile: polar coordinates of the direction `l` that light comes from, `angle` off the axis.
float ies(Light light, vec3 l, float angle) {
    if (light.ies_table == NO_IES) return 1.0;
    float vertical = clamp(light.ies_vertical.x * angle + light.ies_vertical.y, 0.0, PI) / PI;
    float horizontal = fract(atan(dot(l, light.up), dot(l, light.right)) / (2.0 * PI));
    vec2 size = vec2(textureSize(ies_tables, 0).xy);
    vec2 at = (vec2(horizontal, vertical) * (size - 1.0) + 0.5) / size;
    return light.ies_scale * textureLod(ies_tables, vec3(at, float(light.ies_table)), 0.0).r;
}
#endif

// Emission of the light's shape, or of a point on it, over its greatest.
float profile(Light light, vec3 emission_direction) {
#ifdef PROFILES
    if (light.profile == PROFILE_COSINE) return max(dot(light.facing, emission_direction), 0.0);
    if (light.profile == PROFILE_SINE) return length(cross(light.facing, emission_direction));
#endif
    return 1.0;
}

// Along `l`, that one point of a glowing ball stands for: over the mean square of the distance of those on the chord.
float ball_solid_angle(float extent, float radius, vec3 to_centre, vec3 l) {
    float along = dot(to_centre, l), radius_squared = radius * radius;
    float square = 1.5 * along * along + 0.5 * (radius_squared - dot(to_centre, to_centre));
    return extent / max(square, 1e-6 * radius_squared);
}

// Along `l`, that the light's point stands for, seen from a relative position; it depends on the direction alone.
float patch_solid_angle(Light light, vec3 position, vec3 l) {
    if (light.extent == 0.0 || is_distant(light)) return light.extent;
    if (light.is_whole != 0u) return light.extent / dot(light.centre - position, light.centre - position);
    if (light.radius > 0.0) return ball_solid_angle(light.extent, light.radius, light.centre - position, l);
    vec3 to_light = light.position - position;
    return light.extent * profile(light, -l) / dot(to_light, to_light);
}

// The disc of slopes, its radius squared, where a point of the light stands for its whole patch, a disc of solid angle w: half
// vectors turn by half as much. Patches shrink with the number of samples, so that the mean still converges.
float patch_alpha_squared(float solid_angle) {
    return solid_angle / (4.0 * PI);
}

// Of the light's emission along -l, by its cone, focus and IES profile.
vec3 shaped(Light light, vec3 l) {
    vec3 share = vec3(1.0);
#ifdef SHAPED
    float cosine = dot(-l, light.axis);
    float sine = length(cross(l, light.axis));
    if (is_shaped(light)) share *= shaping(light, cosine, sine);
#endif
#ifdef IES
    share *= ies(light, l, atan(sine, cosine));
#endif
    return share;
}

// Light from `light` at a relative position: the unit vector towards it, and the irradiance on a surface facing it.
vec3 irradiance_from(Light light, vec3 position, out vec3 l) {
    if (is_distant(light)) {
        l = -light.axis;
        return light.intensity;
    }
    vec3 to_light = (light.is_whole != 0u ? light.centre : light.position) - position;
    float distance_squared = dot(to_light, to_light), per_distance = inversesqrt(distance_squared);
    l = to_light * per_distance;
    if (distance_squared >= light.reach * light.reach) return vec3(0.0);
    vec3 from_point = light.is_whole != 0u ? normalize(light.position - position) : l;
    float falloff = min(per_distance * per_distance, light.falloff_limit);
    return light.intensity * shaped(light, from_point) * (profile(light, -l) * falloff);
}
