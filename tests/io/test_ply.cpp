#include <cstring>
#include <filesystem>
#include <functional>

#include "io/file.h"
#include "io/ply.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/temporary.h"

using namespace lazyccd;
using namespace lazyccd::io;

namespace {

const std::string header_start = "ply\nformat ascii 1.0\n";
const std::string vertex_header =
    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string face_header = "element face 1\nproperty list uchar int vertex_indices\n";
const std::string header = header_start + vertex_header + face_header + "end_header\n";
const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";

io::Mesh sample_mesh() {
  return {{{0, 0.1, -3e-310}, {1.0 / 3, 2, 1e300}, {-0.0, 4, 5}, {7, 8, 9}},
          {{0, 1, 2}, {3, 2, 1}}};
}

std::string message_of(const std::string& bytes) {
  try {
    parse_ply(bytes, "mesh.ply");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::file);
    return error.what();
  }
  return "no error";
}

template <class Number>
void append_big_endian(std::string& bytes, Number value) {
  char raw[sizeof(value)];
  std::memcpy(raw, &value, sizeof(value));
  for (std::size_t i = sizeof(value); i-- > 0;) bytes += raw[i];
}

}  // namespace

TEST_CASE("a mesh written in any PLY format reads back the same, bit by bit") {
  const test::TemporaryFolder folder;
  const io::Mesh mesh = sample_mesh();
  for (const PlyFormat format :
       {PlyFormat::ascii, PlyFormat::binary_little_endian, PlyFormat::binary_big_endian}) {
    write_ply(folder / "mesh.ply", mesh, format);
    const io::Mesh back = read_ply(folder / "mesh.ply");
    CHECK(back.faces == mesh.faces);
    REQUIRE(back.vertices.size() == mesh.vertices.size());
    CHECK(std::memcmp(back.vertices.data(), mesh.vertices.data(),
                      sizeof(mesh.vertices[0]) * mesh.vertices.size()) == 0);
  }
}

TEST_CASE("a mesh written in single precision reads back as its rounded values") {
  const test::TemporaryFolder folder;
  io::Mesh mesh = sample_mesh();
  mesh.vertices[1][2] = 1e30;
  for (const PlyFormat format :
       {PlyFormat::ascii, PlyFormat::binary_little_endian, PlyFormat::binary_big_endian}) {
    write_ply(folder / "mesh.ply", mesh, format, PlyScalar::float32);
    const io::Mesh back = read_ply(folder / "mesh.ply");
    REQUIRE(back.vertices.size() == mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        CHECK(back.vertices[i][axis] == static_cast<float>(mesh.vertices[i][axis]));
      }
    }
  }
}

TEST_CASE("properties, lists and elements that a mesh does not need are skipped") {
  const io::Mesh mesh = parse_ply(
      "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info none\r\n"
      "element material 1\r\nproperty list uchar float weights\r\nproperty double shine\r\n"
      "element face 1\r\nproperty uchar flag\r\nproperty list ushort uint vertex_index\r\n"
      "property list uchar float uv\r\n"
      "element nothing 5\r\n"
      "element vertex 3\r\nproperty uchar red\r\nproperty double z\r\nproperty double y\r\n"
      "property double x\r\nproperty list int int neighbours\r\nend_header\r\n"
      "4 0.1 0.2 0.3 0.4 5\r\n\r\n"
      "1 3 2 1 0 2 0.5 0.5\r\n"
      "255 3 2 1 1 7\r\n0 6 5 4 0\r\n0 +9 8 7 2 1 1\r\n",
      "mesh.ply");
  CHECK(mesh.faces == std::vector<Face>{{2, 1, 0}});
  CHECK(mesh.vertices == std::vector<std::array<double, 3>>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
}

TEST_CASE("every integer type can hold the corners of a face") {
  const auto read_with = [](const std::string& type, const std::function<void(std::string&)>& add) {
    std::string bytes = "ply\nformat binary_big_endian 1.0\n" + vertex_header +
                        "element face 1\nproperty list uchar " + type +
                        " vertex_indices\nend_header\n";
    for (int i = 0; i < 9; ++i) append_big_endian(bytes, static_cast<float>(i));
    bytes += '\3';
    add(bytes);
    return parse_ply(bytes, "mesh.ply").faces;
  };
  const auto corners_as = [](auto type) {
    return [](std::string& bytes) {
      for (int corner : {2, 0, 1}) {
        append_big_endian(bytes, static_cast<decltype(type)>(corner));
      }
    };
  };
  const std::vector<Face> expected = {{2, 0, 1}};
  CHECK(read_with("char", corners_as(std::int8_t{})) == expected);
  CHECK(read_with("uint8", corners_as(std::uint8_t{})) == expected);
  CHECK(read_with("short", corners_as(std::int16_t{})) == expected);
  CHECK(read_with("ushort", corners_as(std::uint16_t{})) == expected);
  CHECK(read_with("int32", corners_as(std::int32_t{})) == expected);
  CHECK(read_with("uint", corners_as(std::uint32_t{})) == expected);
}

TEST_CASE("a mesh file that is cut short anywhere is an error") {
  const test::TemporaryFolder folder;
  for (const PlyFormat format :
       {PlyFormat::ascii, PlyFormat::binary_little_endian, PlyFormat::binary_big_endian}) {
    write_ply(folder / "mesh.ply", sample_mesh(), format);
    const std::string whole = read_file(folder / "mesh.ply");
    // An ASCII file is valid without its last newline. Without its last digit it is another valid
    // file.
    const std::size_t last = format == PlyFormat::ascii ? whole.size() - 2 : whole.size();
    for (std::size_t length = 0; length < last; ++length) {
      CHECK_THROWS_AS(parse_ply(whole.substr(0, length), "mesh.ply"), Error);
    }
  }
  CHECK_THAT(message_of(header + "0 0 0\n1 0 0\n"),
             Matchers::ContainsSubstring("mesh.ply: line 11: the file is cut short"));
}

TEST_CASE("errors in a mesh file name the line or byte and what was expected") {
  using Matchers::ContainsSubstring;
  CHECK_THAT(message_of("solid cube\n"), ContainsSubstring("line 1: expected 'ply'"));
  CHECK_THAT(message_of("ply\nformat ascii 2.0\n"), ContainsSubstring("line 2: expected 'format'"));
  CHECK_THAT(message_of("ply\nformat ascii 1.0\nproperty int x\n"),
             ContainsSubstring("line 3: a property"));
  CHECK_THAT(message_of(header_start + "element vertex many\n"),
             ContainsSubstring("line 3: expected 'element'"));
  CHECK_THAT(message_of(header_start + "element vertex -1\n"),
             ContainsSubstring("line 3: expected 'element'"));
  CHECK_THAT(message_of(header_start + "element vertex 3\nproperty half x\n"),
             ContainsSubstring("line 4: expected 'property'"));
  CHECK_THAT(message_of(header_start + "element face 1\nproperty list float int vertex_indices\n"),
             ContainsSubstring("line 4: expected 'property'"));
  CHECK_THAT(message_of(header_start + "nonsense\n"),
             ContainsSubstring("line 3: expected element"));
  CHECK_THAT(message_of(header_start + "element vertex 3\n"),
             ContainsSubstring("ends before 'end_header'"));
  CHECK_THAT(message_of(header_start + "element vertex 1\nproperty float x\nproperty float y\n" +
                        face_header + "end_header\n0 0\n3 0 0 0\n"),
             ContainsSubstring("no property z"));
  CHECK_THAT(message_of(header_start + vertex_header +
                        "element face 1\nproperty uchar flag\nend_header\n" + vertices + "1\n"),
             ContainsSubstring("no list vertex_indices"));
  CHECK_THAT(message_of(header + vertices + "3 0 1 2\n1 2 3\n"),
             ContainsSubstring("line 14: the file goes on"));
  CHECK_THAT(message_of(header + "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n"),
             ContainsSubstring("line 11: expected a number of its type, found 'zero'"));
  CHECK_THAT(message_of(header + "0 0 0\n1 0\n0 1 0\n3 0 1 2\n"),
             ContainsSubstring("line 11: the line ends"));
  CHECK_THAT(message_of(header + "0 0 0\n1 0 0 7\n0 1 0\n3 0 1 2\n"),
             ContainsSubstring("line 11: expected the end of the line, found '7'"));
  CHECK_THAT(message_of(header + vertices + "3 0 1 2.5\n"),
             ContainsSubstring("line 13: expected a whole number"));
  CHECK_THAT(message_of(header + vertices + "300 0 1 2\n"),
             ContainsSubstring("line 13: expected a whole number"));
}

TEST_CASE("a mesh file with bad positions, faces or indices names the vertex or face") {
  using Matchers::ContainsSubstring;
  CHECK_THAT(message_of(header + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"),
             ContainsSubstring("line 11: vertex 1 is not finite"));
  CHECK_THAT(message_of(header + "0 0 0\n1 0 -inf\n0 1 0\n3 0 1 2\n"),
             ContainsSubstring("line 11: vertex 1 is not finite"));
  CHECK_THAT(message_of(header + vertices + "4 0 1 2 0\n"),
             ContainsSubstring("line 13: face 0 has 4 corners"));
  CHECK_THAT(message_of(header + vertices + "3 0 1 3\n"),
             ContainsSubstring("face 0 names vertex 3"));
  CHECK_THAT(message_of(header + vertices + "3 0 -1 2\n"),
             ContainsSubstring("line 13: face 0 names vertex -1"));
  try {
    parse_ply(header + vertices + "3 0 1 3\n", "mesh.ply");
    FAIL("an index out of range was accepted");
  } catch (const Error& error) {
    CHECK(error.primitive() == 0);
  }

  std::string bytes =
      "ply\nformat binary_big_endian 1.0\n" + vertex_header + face_header + "end_header\n";
  const std::size_t start = bytes.size();
  for (int i = 0; i < 9; ++i) {
    append_big_endian(bytes, i == 5 ? std::numeric_limits<float>::infinity() : 1.0f);
  }
  CHECK_THAT(message_of(bytes),
             ContainsSubstring("byte " + std::to_string(start + 12) + ": vertex 1 is not finite"));
}

TEST_CASE("an empty mesh, an empty file, a missing file and a folder are errors") {
  using Matchers::ContainsSubstring;
  CHECK_THAT(message_of(header_start + face_header + "end_header\n3 0 0 0\n"),
             ContainsSubstring("no vertices"));
  CHECK_THAT(message_of(header_start + vertex_header + "end_header\n" + vertices),
             ContainsSubstring("no faces"));
  const test::TemporaryFolder folder;
  write_file(folder / "empty.ply", "");
  CHECK_THROWS_WITH(read_ply(folder / "empty.ply"), ContainsSubstring("is empty"));
  CHECK_THROWS_WITH(read_ply(folder / "missing.ply"), ContainsSubstring("cannot be opened"));
  CHECK_THROWS_WITH(read_ply(folder.path()), ContainsSubstring("is a folder"));
  CHECK_THROWS_WITH(write_ply(folder / "missing" / "mesh.ply", sample_mesh()),
                    ContainsSubstring("cannot be opened for writing"));
}

TEST_CASE("two frames of different topology are told apart by their first difference") {
  using Matchers::ContainsSubstring;
  const io::Mesh mesh = sample_mesh();
  CHECK_NOTHROW(require_same_topology(mesh, "a.ply", mesh, "b.ply"));
  io::Mesh other = mesh;
  other.vertices.push_back({0, 0, 0});
  CHECK_THROWS_WITH(require_same_topology(mesh, "a.ply", other, "b.ply"),
                    ContainsSubstring("a.ply has 4 vertices, b.ply has 5"));
  other = mesh;
  other.faces.pop_back();
  CHECK_THROWS_WITH(require_same_topology(mesh, "a.ply", other, "b.ply"),
                    ContainsSubstring("a.ply has 2 faces, b.ply has 1"));
  other = mesh;
  other.faces[1] = {1, 3, 2};
  CHECK_THROWS_WITH(require_same_topology(mesh, "a.ply", other, "b.ply"),
                    ContainsSubstring("face 1 is (3, 2, 1) in a.ply and (1, 3, 2) in b.ply"));
}
