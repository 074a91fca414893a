// Sets of texture coordinates, two in a column.
#ifdef MANY_UVS
#define UvSets mat4
#else
#define UvSets vec4
#endif
