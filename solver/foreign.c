#include "solver/foreign.h"

#include <string.h>

/* Magic numbers of the formats that people have beside the ones that are read. */
static const struct {
	size_t offset, size;
	const char *bytes;
	const char *kind;
} kinds[] = {
	{0, 4, "PK\3\4", "a zip archive; unpack it and send the files in it"},
	{0, 2, "\x1f\x8b", "compressed with gzip; unpack it"},
	{0, 6,
	 "\xfd"
	 "7zXZ",
	 "compressed with xz; unpack it"},
	{0, 3, "BZh", "compressed with bzip2; unpack it"},
	{0, 4, "\x28\xb5\x2f\xfd", "compressed with zstd; unpack it"},
	{0, 18, "Kaydara FBX Binary", "FBX; export OBJ for a mesh, PC2 or MDD for a motion"},
	{0, 5, "; FBX", "FBX; export OBJ for a mesh, PC2 or MDD for a motion"},
	{0, 5, "Ogawa", "Alembic; open it in Blender or Houdini and export OBJ for a mesh, MDD or PC2 for a motion"},
	{0, 8, "\x89HDF\r\n\x1a\n",
	 "Alembic or HDF5; open it in Blender or Houdini and export OBJ for a mesh, MDD or PC2 for a motion"},
	{0, 4, "glTF", "glTF; open it in Blender and export OBJ with UV coordinates"},
	{0, 8, "PXR-USDC", "USD; open it in Blender or Houdini and export OBJ for a mesh, MDD or PC2 for a motion"},
	{0, 5, "#usda", "USD; open it in Blender or Houdini and export OBJ for a mesh, MDD or PC2 for a motion"},
	{0, 7, "BLENDER", "a Blender file; export OBJ for a mesh, PC2 or MDD for a motion"},
	{0, 9, "HIERARCHY", "a skeleton's motion (BVH); simulate the garment on it and export PC2 or MDD"},
	{0, 5, "%PDF-", "a PDF"},
	{0, 4, "\x89PNG", "a picture"},
	{0, 3, "\xff\xd8\xff", "a picture"},
	{0, 2, "\xff\xfe", "text in UTF-16; save it as UTF-8"},
	{0, 2, "\xfe\xff", "text in UTF-16; save it as UTF-8"},
	{257, 5, "ustar", "a tar archive; a motion may be one, of one OBJ for each frame"},
	{0, 11, "POINTCACHE2", "a motion (PC2), not a mesh"},
	{0, 8, "TWFRAME1", "a packed motion, not a mesh"},
	{0, 5, "<?xml", "XML"},
	{0, 9, "<!DOCTYPE", "a web page"},
	{0, 5, "<html", "a web page"},
	{0, 1, "{", "JSON"},
};

const char *foreign_kind(const void *bytes, size_t size)
{
	for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
		if (size >= kinds[i].offset + kinds[i].size &&
		    memcmp((const char *)bytes + kinds[i].offset, kinds[i].bytes, kinds[i].size) == 0)
			return kinds[i].kind;
	}
	return NULL;
}
