#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/recording/points.h"
#include "client/sheet_layout.h"

namespace weft::client {

// One of each particle: "pressure" in Pa, "clearance" in m.
struct ExportValues {
  std::string name;
  std::vector<double> values;
};

// A part of a frame as an export writes it.
struct ExportFrame {
  std::int64_t number = 0;
  double time_s = 0;
  Points points;
  std::vector<ExportValues> values;  // as far as they were recorded
};

// Writes frames in the format of another tool.
class FrameWriter {
 public:
  virtual ~FrameWriter() = default;
  virtual void add(const ExportFrame& frame) = 0;
  // Ends the output; without it, it is not whole.
  virtual void finish() = 0;
};

// A row for every frame: t, x0, y0, z0, x1 ..., then pressure0, pressure1 ... of each of the values
// with these names.
std::unique_ptr<FrameWriter> make_csv_writer(const std::string& path, std::size_t particles,
                                             const std::vector<std::string>& values);

// Point cache of Blender, 3ds Max and Marvelous Designer, float32.
std::unique_ptr<FrameWriter> make_pc2_writer(const std::string& path, std::size_t particles,
                                             std::int64_t first_frame);

// A directory of files cloth_000123.obj with the cells of grids as quads; triangles with normals
// and the flat shape, in a group for each panel.
std::unique_ptr<FrameWriter> make_obj_writer(const std::string& directory,
                                             std::vector<SheetMesh> sheets);

// Point cache of LightWave, Blender and Marvelous Designer, float32.
std::unique_ptr<FrameWriter> make_mdd_writer(const std::string& path, std::size_t particles,
                                             std::size_t frames);

// Binary glTF 2.0: the cells as triangles with normals, the first frame as the mesh, the others as
// morph targets of an animation. Where there are sheets of triangles each panel is a primitive; a
// particle that has several corners in the flat shape is as many vertices, and attribute _PARTICLE
// says which one it is. Values with these names are attributes where there is one frame: _PRESSURE.
std::unique_ptr<FrameWriter> make_gltf_writer(const std::string& path,
                                              const std::vector<SheetMesh>& sheets,
                                              std::size_t frames,
                                              const std::vector<std::string>& values);

// ParaView's collection x.pvd, and a directory x of meshes frame_000123.vtp, float64. Where there
// are sheets of triangles each cell says its panel, and u and v of its corners. Values are
// PointData.
std::unique_ptr<FrameWriter> make_vtk_writer(const std::string& path,
                                             const std::vector<SheetMesh>& sheets);

// What USD needs to know of time and space; a frame's time code is its number.
struct UsdStage {
  std::int64_t first_frame = 0;
  std::int64_t last_frame = 0;
  double frames_per_second = 60;
  char up_axis = 'Y';  // or Z
};

// USD text: one mesh of all sheets, its faces in a subset for each; points as time samples,
// float32. Where there are sheets of triangles each panel is a subset, too, and the flat shape is
// primvars:st.
std::unique_ptr<FrameWriter> make_usd_writer(const std::string& path,
                                             const std::vector<SheetMesh>& sheets,
                                             const UsdStage& stage);

// Arrays of NumPy: vertices_seq (frames, particles, 3) float32, faces (triangles, 3) int32,
// vertices_uv (corners, 2) float32, faces_uv (triangles, 3) int32, panel (triangles) int32,
// panel_names, fps; values as (frames, particles) float32.
std::unique_ptr<FrameWriter> make_npz_writer(const std::string& path,
                                             const std::vector<SheetMesh>& sheets,
                                             std::size_t frames, double frames_per_second);

}  // namespace weft::client
