// The one C++ file: OpenMesh's readers, fed from memory and read out at the importer interface.
//
// An OpenMesh reader parses a stream and tells a BaseImporter what it found. Two importers stand here: Collector keeps
// it, Witness compares it with what our own reader of OBJ found. No mesh is built.

#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/System/omstream.hh>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <istream>
#include <mutex>
#include <new>
#include <streambuf>
#include <string>
#include <vector>

#include <jansson.h>

// Our C headers know nothing of C++: their functions have C names, and a function may be named like a struct.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
extern "C" {
#include "solver/garment/openmesh.h"
}
#pragma GCC diagnostic pop

namespace
{

namespace io = OpenMesh::IO;
using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::Vec2f;
using OpenMesh::Vec3d;
using OpenMesh::Vec3f;
using OpenMesh::Vec3uc;
using OpenMesh::Vec4f;
using OpenMesh::Vec4uc;
using OpenMesh::VertexHandle;
using Status = OpenMesh::Attributes::StatusInfo;

// What a garment has no use for: colours, normals, halfedges.
class Importer : public io::BaseImporter
{
      public:
	VertexHandle add_vertex() override
	{
		return add_vertex(Vec3f(0, 0, 0));
	}
	VertexHandle add_vertex(const Vec3f &) override = 0;
	VertexHandle add_vertex(const Vec3d &point) override
	{
		return add_vertex(Vec3f(point));
	}
	HalfedgeHandle add_edge(VertexHandle, VertexHandle) override
	{
		return HalfedgeHandle();
	}
	FaceHandle add_face(const VHandles &) override = 0;
	FaceHandle add_face(HalfedgeHandle) override
	{
		return FaceHandle();
	}
	void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec2f> &) override
	{
	}
	void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec3f> &) override
	{
	}
	void set_face_texindex(FaceHandle, int) override
	{
	}
	void set_point(VertexHandle, const Vec3f &) override
	{
	}
	void set_halfedge(VertexHandle, HalfedgeHandle) override
	{
	}
	void set_normal(VertexHandle, const Vec3f &) override
	{
	}
	void set_normal(VertexHandle, const Vec3d &) override
	{
	}
	void set_normal(FaceHandle, const Vec3f &) override
	{
	}
	void set_normal(FaceHandle, const Vec3d &) override
	{
	}
	void set_color(VertexHandle, const Vec3uc &) override
	{
	}
	void set_color(VertexHandle, const Vec4uc &) override
	{
	}
	void set_color(VertexHandle, const Vec3f &) override
	{
	}
	void set_color(VertexHandle, const Vec4f &) override
	{
	}
	void set_color(EdgeHandle, const Vec3uc &) override
	{
	}
	void set_color(EdgeHandle, const Vec4uc &) override
	{
	}
	void set_color(EdgeHandle, const Vec3f &) override
	{
	}
	void set_color(EdgeHandle, const Vec4f &) override
	{
	}
	void set_color(FaceHandle, const Vec3uc &) override
	{
	}
	void set_color(FaceHandle, const Vec4uc &) override
	{
	}
	void set_color(FaceHandle, const Vec3f &) override
	{
	}
	void set_color(FaceHandle, const Vec4f &) override
	{
	}
	void set_texcoord(VertexHandle, const Vec2f &) override
	{
	}
	void set_texcoord(VertexHandle, const Vec3f &) override
	{
	}
	void set_texcoord(HalfedgeHandle, const Vec2f &) override
	{
	}
	void set_texcoord(HalfedgeHandle, const Vec3f &) override
	{
	}
	void set_status(VertexHandle, const Status &) override
	{
	}
	void set_status(HalfedgeHandle, const Status &) override
	{
	}
	void set_status(EdgeHandle, const Status &) override
	{
	}
	void set_status(FaceHandle, const Status &) override
	{
	}
	void set_next(HalfedgeHandle, HalfedgeHandle) override
	{
	}
	void set_face(HalfedgeHandle, FaceHandle) override
	{
	}
	void request_face_texcoords2D() override
	{
	}
	void add_texture_information(int, std::string) override
	{
	}
	size_t n_edges() const override
	{
		return 0;
	}
};

class Collector : public Importer
{
      public:
	using Importer::add_face;
	using Importer::add_vertex;

	std::vector<Vec3f> points;
	std::vector<uint32_t> starts{0};
	std::vector<uint32_t> corners;

	VertexHandle add_vertex(const Vec3f &point) override
	{
		points.push_back(point);
		return VertexHandle(static_cast<int>(points.size() - 1));
	}
	void set_point(VertexHandle vertex, const Vec3f &point) override
	{
		points.at(static_cast<size_t>(vertex.idx())) = point;
	}
	FaceHandle add_face(const VHandles &vertices) override
	{
		for (VertexHandle vertex : vertices)
			corners.push_back(static_cast<uint32_t>(vertex.idx()));
		starts.push_back(static_cast<uint32_t>(corners.size()));
		return FaceHandle(static_cast<int>(starts.size() - 2));
	}
	size_t n_vertices() const override
	{
		return points.size();
	}
	size_t n_faces() const override
	{
		return starts.size() - 1;
	}
};

class Witness : public Importer
{
      public:
	using Importer::add_face;
	using Importer::add_face_texcoords;
	using Importer::add_vertex;

	explicit Witness(const struct soup &said) : soup(said)
	{
	}

	VertexHandle add_vertex(const Vec3f &point) override
	{
		if (vertices < soup.vertex_count) {
			const double *position = soup.position + 3 * static_cast<size_t>(vertices);
			for (unsigned axis = 0; axis < 3; axis++)
				same_vertices &= is_near(point[axis], position[axis]);
		}
		return VertexHandle(static_cast<int>(vertices++));
	}
	FaceHandle add_face(const VHandles &corners) override
	{
		bool same = polygons < soup.polygon_count && corners.size() == corner_count(polygons);
		for (size_t i = 0; same && i < corners.size(); i++)
			same = static_cast<uint32_t>(corners[i].idx()) ==
			       soup.corner_vertex[soup.polygon_start[polygons] + i];
		if (same && first_difference == polygons)
			first_difference++;
		return FaceHandle(static_cast<int>(polygons++));
	}
	void add_face_texcoords(FaceHandle face, VertexHandle, const std::vector<Vec2f> &coords) override
	{
		const uint32_t polygon = static_cast<uint32_t>(face.idx());
		if (!soup.corner_coord || polygon + 1 != first_difference)
			return;
		bool same = coords.size() == corner_count(polygon);
		for (size_t i = 0; same && i < coords.size(); i++) {
			const uint32_t coord = soup.corner_coord[soup.polygon_start[polygon] + i];
			same = is_near(coords[i][0], soup.coord[2 * static_cast<size_t>(coord)]) &&
			       is_near(coords[i][1], soup.coord[2 * static_cast<size_t>(coord) + 1]);
		}
		if (!same)
			first_difference--;
	}
	size_t n_vertices() const override
	{
		return vertices;
	}
	size_t n_faces() const override
	{
		return polygons;
	}

	bool agrees() const
	{
		return same_vertices && vertices == soup.vertex_count && polygons == soup.polygon_count &&
		       first_difference == polygons;
	}

	uint32_t first_difference = 0; // polygons before it are the same

      private:
	// OpenMesh keeps floats.
	static bool is_near(float seen, double said)
	{
		return std::fabs(static_cast<double>(seen) - said) <= 1e-6 * std::fabs(said) + 1e-30;
	}
	size_t corner_count(uint32_t polygon) const
	{
		return soup.polygon_start[polygon + 1] - soup.polygon_start[polygon];
	}

	const struct soup &soup;
	uint32_t vertices = 0, polygons = 0;
	bool same_vertices = true;
};

// Bytes in memory as a stream; seeks to any place.
class MemoryBuffer : public std::streambuf
{
      public:
	explicit MemoryBuffer(struct text file)
	{
		char *at = const_cast<char *>(file.at);
		setg(at, at, const_cast<char *>(file.end));
	}

      protected:
	pos_type seekoff(off_type by, std::ios_base::seekdir from, std::ios_base::openmode) override
	{
		char *base = from == std::ios_base::beg ? eback() : from == std::ios_base::cur ? gptr() : egptr();
		if (by < eback() - base || by > egptr() - base)
			return pos_type(off_type(-1));
		setg(eback(), base + by, egptr());
		return pos_type(gptr() - eback());
	}
	pos_type seekpos(pos_type to, std::ios_base::openmode mode) override
	{
		return seekoff(off_type(to), std::ios_base::beg, mode);
	}
};

// The lines of a text that count, joined lines as one. The reader of OBJ never meets an `mtllib`, which would make it
// open a file that the upload names. Seeks to the start only.
class LineBuffer : public std::streambuf
{
      public:
	LineBuffer(struct text file, bool (*counts)(struct text)) : whole(file), rest(file), line_counts(counts)
	{
	}

      protected:
	int_type underflow() override
	{
		struct text line;
		for (uint32_t number = 0; text_next_line(&rest, &line, &number);) {
			if (!line_counts(line))
				continue;
			joined.assign(line.at, line.end);
			if (number > 1) {
				for (char &c : joined)
					c = c == '\n' || c == '\r' || c == '\\' ? ' ' : c;
			}
			joined.push_back('\n');
			setg(joined.data(), joined.data(), joined.data() + joined.size());
			return traits_type::to_int_type(joined[0]);
		}
		return traits_type::eof();
	}
	pos_type seekoff(off_type by, std::ios_base::seekdir from, std::ios_base::openmode) override
	{
		if (by != 0 || from != std::ios_base::beg)
			return pos_type(off_type(-1));
		rest = whole;
		setg(nullptr, nullptr, nullptr);
		return pos_type(0);
	}
	pos_type seekpos(pos_type to, std::ios_base::openmode mode) override
	{
		return seekoff(off_type(to), std::ios_base::beg, mode);
	}

      private:
	struct text whole, rest;
	bool (*line_counts)(struct text);
	std::string joined;
};

std::mutex readers_mutex;

io::BaseReader &reader_of(enum mesh_format format)
{
	switch (format) {
	case MESH_OFF:
		return io::OFFReader();
	case MESH_STL:
		return io::STLReader();
	default:
		return io::OBJReader();
	}
}

bool run_reader(enum mesh_format format, bool binary, std::streambuf &buffer, Importer &importer)
{
	const std::lock_guard<std::mutex> lock(readers_mutex);
	omerr().disable();
	omlog().disable();
	omout().disable();
	io::Options options = format == MESH_OBJ ? io::Options::FaceTexCoord : io::Options::Default;
	if (binary && format == MESH_STL)
		options += io::Options::Binary;
	std::istream stream(&buffer);
	return reader_of(format).read(stream, importer, options);
}

// Runs `work`, which returns a status; what it throws becomes one.
template <typename Work> enum tw_status guarded(struct tw_error *error, Work work)
{
	try {
		return work();
	} catch (const std::bad_alloc &) {
		return tw_fail_memory(error);
	} catch (...) {
		return tw_fail(error, TW_ERROR_INPUT, "mesh-unreadable", nullptr,
			       "the file's structure is damaged; export it again");
	}
}

enum tw_status unreadable(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "mesh-unreadable", nullptr,
		       "the file could not be read as its header describes it; export it again, with plain vertices "
		       "and faces only");
}

enum tw_status keep(const Collector &found, struct soup *soup, struct arena *arena, struct tw_error *error)
{
	*soup = {};
	soup->vertex_count = static_cast<uint32_t>(found.points.size());
	soup->polygon_count = static_cast<uint32_t>(found.n_faces());
	soup->corner_count = static_cast<uint32_t>(found.corners.size());
	soup->position = ARENA_ARRAY(arena, 3 * found.points.size(), double);
	soup->polygon_start = ARENA_ARRAY(arena, found.starts.size(), uint32_t);
	soup->corner_vertex = ARENA_ARRAY(arena, found.corners.size(), uint32_t);
	if (!soup->position || !soup->polygon_start || !soup->corner_vertex)
		return tw_fail_memory(error);
	for (size_t v = 0; v < found.points.size(); v++) {
		for (unsigned axis = 0; axis < 3; axis++)
			soup->position[3 * v + axis] = static_cast<double>(found.points[v][axis]);
	}
	std::copy(found.starts.begin(), found.starts.end(), soup->polygon_start);
	std::copy(found.corners.begin(), found.corners.end(), soup->corner_vertex);
	return TW_OK;
}

// Our readers have checked all of this in the file; here it is checked in what came out.
bool is_sound(const Collector &found)
{
	for (size_t p = 0; p < found.n_faces(); p++) {
		if (found.starts[p + 1] - found.starts[p] < 3 ||
		    found.starts[p + 1] - found.starts[p] > POLYGON_CORNERS)
			return false;
	}
	for (uint32_t vertex : found.corners) {
		if (vertex >= found.points.size())
			return false;
	}
	for (const Vec3f &point : found.points) {
		if (!std::isfinite(point[0]) || !std::isfinite(point[1]) || !std::isfinite(point[2]))
			return false;
	}
	return true;
}

} // namespace

enum tw_status openmesh_read(struct soup *soup, struct arena *arena, struct text file, enum mesh_format format,
			     bool binary, uint32_t vertex_count, uint32_t polygon_count, struct tw_error *error)
{
	return guarded(error, [&] {
		Collector found;
		MemoryBuffer bytes(file);
		LineBuffer lines(file, off_line_counts);
		std::streambuf &buffer = format == MESH_OFF ? static_cast<std::streambuf &>(lines) : bytes;
		if (!run_reader(format, binary, buffer, found) || !is_sound(found) ||
		    found.n_faces() != polygon_count || (format != MESH_STL && found.n_vertices() != vertex_count))
			return unreadable(error);
		return keep(found, soup, arena, error);
	});
}

enum tw_status openmesh_agrees_on_obj(const struct soup *soup, struct text file, struct tw_error *error)
{
	return guarded(error, [&] {
		Witness witness(*soup);
		LineBuffer buffer(file, obj_line_is_geometry);
		if (run_reader(MESH_OBJ, false, buffer, witness) && witness.agrees())
			return TW_OK;
		if (witness.first_difference < soup->polygon_count)
			return fail_at_line(
				error, "mesh-ambiguous", soup->polygon_line[witness.first_difference],
				"two readers understand face %u differently; write it as plain v/vt corners",
				witness.first_difference);
		return tw_fail(error, TW_ERROR_INPUT, "mesh-ambiguous", nullptr,
			       "two readers understand the vertices of this file differently; write them as plain "
			       "`v x y z` lines");
	});
}
