// The one C++ file: OpenMesh's readers, fed from memory and heard at their importer interface.
//
// An OpenMesh reader parses a stream and tells a BaseImporter what it found. The importer here compares that with what
// our own reader found; no mesh is built.

#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/System/omstream.hh>

#include <algorithm>
#include <cctype>
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
	// clang-format off
	HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
	FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
	void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec3f> &) override {}
	void add_texture_information(int, std::string) override {}
	void request_face_texcoords2D() override {}
	void set_color(EdgeHandle, const Vec3f &) override {}
	void set_color(EdgeHandle, const Vec3uc &) override {}
	void set_color(EdgeHandle, const Vec4f &) override {}
	void set_color(EdgeHandle, const Vec4uc &) override {}
	void set_color(FaceHandle, const Vec3f &) override {}
	void set_color(FaceHandle, const Vec3uc &) override {}
	void set_color(FaceHandle, const Vec4f &) override {}
	void set_color(FaceHandle, const Vec4uc &) override {}
	void set_color(VertexHandle, const Vec3f &) override {}
	void set_color(VertexHandle, const Vec3uc &) override {}
	void set_color(VertexHandle, const Vec4f &) override {}
	void set_color(VertexHandle, const Vec4uc &) override {}
	void set_face(HalfedgeHandle, FaceHandle) override {}
	void set_face_texindex(FaceHandle, int) override {}
	void set_halfedge(VertexHandle, HalfedgeHandle) override {}
	void set_next(HalfedgeHandle, HalfedgeHandle) override {}
	void set_normal(FaceHandle, const Vec3d &) override {}
	void set_normal(FaceHandle, const Vec3f &) override {}
	void set_normal(VertexHandle, const Vec3d &) override {}
	void set_normal(VertexHandle, const Vec3f &) override {}
	void set_status(EdgeHandle, const Status &) override {}
	void set_status(FaceHandle, const Status &) override {}
	void set_status(HalfedgeHandle, const Status &) override {}
	void set_status(VertexHandle, const Status &) override {}
	void set_texcoord(HalfedgeHandle, const Vec2f &) override {}
	void set_texcoord(HalfedgeHandle, const Vec3f &) override {}
	void set_texcoord(VertexHandle, const Vec2f &) override {}
	void set_texcoord(VertexHandle, const Vec3f &) override {}
	size_t n_edges() const override { return 0; }
	// clang-format on
};

class Witness : public Importer
{
      public:
	using Importer::add_face;
	using Importer::add_face_texcoords;

	explicit Witness(const struct soup &said) : soup(said)
	{
	}
	VertexHandle add_vertex() override
	{
		return VertexHandle(static_cast<int>(vertices++));
	}
	VertexHandle add_vertex(const Vec3f &point) override
	{
		const VertexHandle vertex = add_vertex();
		set_point(vertex, point);
		return vertex;
	}
	VertexHandle add_vertex(const Vec3d &point) override
	{
		return add_vertex(Vec3f(point));
	}
	void set_point(VertexHandle vertex, const Vec3f &point) override
	{
		const size_t v = static_cast<size_t>(vertex.idx());
		for (unsigned axis = 0; axis < 3 && v < soup.vertex_count; axis++)
			same_vertices &= is_near(point[axis], soup.position[3 * v + axis]);
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

// Bytes in memory as a stream.
class MemoryBuffer : public std::streambuf
{
      public:
	explicit MemoryBuffer(struct text file)
	{
		char *at = const_cast<char *>(file.at);
		setg(at, at, const_cast<char *>(file.end));
	}
};

// The lines of a text that count, as a plain file would have them: without comments, joined lines as one, keywords in
// the case that the readers know, no slashes with nothing behind them. The reader of OBJ never meets an `mtllib`, which
// would make it open a file that the upload names. Seeks to the start only, which is what the readers do.
class LineBuffer : public std::streambuf
{
      public:
	LineBuffer(struct text file, enum mesh_format of) : whole(file), rest(file), format(of)
	{
		text_skip_mark(&whole);
		rest = whole;
	}

      protected:
	int_type underflow() override
	{
		struct text line;
		uint32_t number = 0;
		while (next_line(line, number)) {
			if (!(format == MESH_OBJ ? obj_line_is_geometry(line) : off_line_counts(line)))
				continue;
			if (format == MESH_OBJ)
				take_obj(line);
			else
				take_words(line);
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
	bool next_line(struct text &line, uint32_t &number)
	{
		return format == MESH_OBJ ? obj_next_line(&rest, &line, &number)
					  : text_next_line(&rest, &line, &number);
	}
	// As it stands, but for what a plain file would not have.
	void take_obj(struct text line)
	{
		joined.assign(line.at, line.end);
		joined.resize(std::min(joined.size(), joined.find('#'))); // a comment
		for (size_t i = joined.find('\\'); i < joined.size(); i++)
			joined[i] = joined[i] == '\n' || joined[i] == '\r' || joined[i] == '\\' ? ' ' : joined[i];
		size_t i = joined.find_first_not_of(" \t\v\f");
		for (; i < joined.size() && std::isalpha(static_cast<unsigned char>(joined[i])); i++)
			joined[i] = static_cast<char>(std::tolower(static_cast<unsigned char>(joined[i])));
		if (joined.find('/') == std::string::npos)
			return;
		for (i = joined.size(); i-- > 0;) {
			const bool last =
				i + 1 == joined.size() || std::isspace(static_cast<unsigned char>(joined[i + 1]));
			if (joined[i] == '/' && last)
				joined[i] = ' ';
		}
	}
	void take_words(struct text line)
	{
		joined.clear();
		for (struct text word; text_next_word(&line, &word);) {
			if (!joined.empty())
				joined.push_back(' ');
			for (const char *c = word.at; c < word.end; c++)
				joined.push_back(static_cast<char>(
					format == MESH_OFF ? std::toupper(static_cast<unsigned char>(*c))
							   : std::tolower(static_cast<unsigned char>(*c))));
		}
	}

	struct text whole, rest;
	enum mesh_format format;
	std::string joined;
};

std::mutex readers_mutex;

bool run_reader(enum mesh_format format, bool binary, std::streambuf &buffer, Witness &witness)
{
	const std::lock_guard<std::mutex> lock(readers_mutex);
	omerr().disable();
	omlog().disable();
	omout().disable();
	std::istream stream(&buffer);
	io::Options options = binary ? io::Options::Binary : io::Options::Default;
	if (format == MESH_STL)
		return io::STLReader().read(stream, witness, options);
	if (format == MESH_OFF)
		return io::OFFReader().read(stream, witness, options);
	options = io::Options::FaceTexCoord;
	return io::OBJReader().read(stream, witness, options);
}

enum tw_status compare(const struct soup *soup, struct text file, enum mesh_format format, bool binary,
		       struct tw_error *error)
{
	Witness witness(*soup);
	MemoryBuffer bytes(file);
	LineBuffer lines(file, format);
	std::streambuf &buffer = binary ? static_cast<std::streambuf &>(bytes) : lines;
	if (run_reader(format, binary, buffer, witness) && witness.agrees())
		return TW_OK;
	const uint32_t face = witness.first_difference;
	char where[32] = "";
	if (face < soup->polygon_count)
		snprintf(where, sizeof where, soup->polygon_line ? "line %u" : "face %u",
			 soup->polygon_line ? soup->polygon_line[face] : face);
	return tw_fail(error, TW_ERROR_INPUT, "mesh-ambiguous", where,
		       "two readers understand this file differently; write plain vertices and faces, one a line, with "
		       "coordinates below 1e38");
}

} // namespace

enum tw_status openmesh_agrees(const struct soup *soup, struct text file, enum mesh_format format, bool binary,
			       struct tw_error *error)
{
	try {
		return compare(soup, file, format, binary, error);
	} catch (const std::bad_alloc &) {
		return tw_fail_memory(error);
	} catch (...) {
		return tw_fail(error, TW_ERROR_INPUT, "mesh-ambiguous", nullptr,
			       "the file's structure is damaged; export it again");
	}
}
