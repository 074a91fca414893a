// What the CPU uploads, std430. The NumPy dtypes are derived from these structs.

struct View {
    mat4 clip_from_relative;
    mat4 relative_from_camera; // its offset: the sample's place on the lens
    vec3 first;                // from the eye to the image's top left, one unit ahead in perspective
    vec3 right;                // from a pixel to the next
    vec3 down;
    vec2 depth_coefficients;   // camera depth z: 1 / z (perspective) or z (orthographic) = x * stored + y
    vec2 size;                 // pixels
    vec2 origin;               // of the first pixel in the display window
    vec4 cell;                 // of its pixel that the sample stands for: its middle from the sample, its size, in pixels, y down
    float exposure;
    uint sample_index;
    float sky_share;           // of a dome, that four of its directions stand for
    float lobe_rays;           // of a pixel, in all samples together
    float roughest_rays;       // roughness from which on a surface sends none
};

struct Instance {
    mat4 relative_from_object;
    mat4 relative_from_normal; // inverse transpose of the linear part
    vec3 display_color;
    float display_opacity;
    float handedness;          // -1 where the placement mirrors
    uint link_set;
};

struct Motion {
    mat4 clip_before_from_object;
    mat4 clip_now_from_object;
    mat4 clip_after_from_object;
};

struct Material {
    vec3 diffuse_color;
    float metallic;
    vec3 emissive_color;
    float roughness;
    vec3 specular_color;
    float ior;
    float clearcoat;
    float clearcoat_roughness;
    float opacity;
    float opacity_threshold;
    uint use_specular_workflow;
    uint uses_display_color;
    uint uses_display_opacity;
    uint is_transparent;       // opacity scales the diffuse alone
    uint one_sided;
    uint first_input;          // of its textures
    uint input_count;
    float occlusion;
};

struct TextureInput {
    vec4 scale;
    vec4 bias;
    vec4 texture_from_uv;      // columns of the linear part
    vec2 texture_offset;
    uint uv_set;               // of those that a vertex has
    uint channel;              // 0 to 3, or 4 for all
    uint field;                // of the material, numbered by generated/textures.glsl
    uint wrap_s;
    uint wrap_t;
    uint first_tile;
    uint tile_count;           // UDIM: columns of 10, row by row
};

struct Tile {
    vec2 size;                 // texels
    uint group;                // which texture array
    uint layer;
};

struct Light {
    vec3 position;
    float reach;
    vec3 axis;                 // unit, the direction of emission
    float cone_angle;          // radians off the axis; pi for no cone
    vec3 facing;               // unit, what the profile is measured from
    float cone_smooth_start;   // radians: where the fall to the cone's edge begins
    vec3 intensity;            // candela-like on axis; irradiance of a distant light
    float focus;
    vec3 focus_tint;
    uint profile;
    vec2 response;             // multipliers of the diffuse and of the specular lobe
    uint first_shadow;         // of its maps in the atlas, if they are six faces of a cube
    uint first_shadow_map;     // its ShadowMap, if it has a single one
    uint shadow_count;         // 0: casts none
    uint is_sky;               // one of the few directions that stand for a dome
    float extent;              // area that the point stands for; a distant light's solid angle; 0 for a point
    float falloff_limit;       // of 1 / distance²: there `extent` covers all that a surface sees
    uint is_whole;             // it shines from its centre and shows in lobes as a whole; the sample's point casts its shadows
    uint by_rays;              // lobes see it by rays of each pixel's own as well
    vec3 right;                // unit, the light's X and Y: what an IES profile's horizontal angle is measured from
    float ies_scale;           // of its candela
    vec3 up;
    uint ies_table;            // its layer; NO_IES for none
    uint first_link;           // bits of the link sets that it lights: lib/linking.glsl
    vec3 shadow_color;         // what a full shadow leaves of the light
    float shadow_distance;     // of the farthest occluder; negative for no limit
    float shadow_fading;       // depth of the zone before it in which shadows fade
    float shadow_gamma;
    vec2 ies_vertical;         // the profile is read at x * angle + y radians
    vec3 centre;
    float radius;              // of the glowing ball around it that the point lies in; 0 for another
};

struct Lamp {
    vec4 x;                    // rows that take a relative position to the lamp's own space, where it is of unit size
    vec4 y;
    vec4 z;
    vec3 radiance;
    uint shape;
    vec3 centre;
    float radius;              // of what is around all of it; of a distant light the chord of its half angle
    float area;                // that one of its points stands for, in its own space; a solid angle of a distant light
    float stretch;             // volume in the world of a unit cube of its space
    vec2 bias;                 // by which a cylinder's points turn to what is lit
    uvec2 cells;               // columns and rows of what a rectangle shows; 0 for none
    uint first_cell;
    uint casts_shadow;
};

struct ShadowMap {
    vec4 x;                    // rows that take a relative position to a texel of the atlas and to what it stores, over w
    vec4 y;
    vec4 z;
    vec4 w;
    vec2 least;                // texel where it begins
    float side;                // texels
    vec2 depth_coefficients;   // depth z: 1 / z, or z for a distant light, = x * stored + y
};
