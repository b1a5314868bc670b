// SPDX-License-Identifier: LGPL-2.1-or-later
// Reads an SDF file with libsdformat, the format's own reader, and prints what it found, one link a line.
#include <cmath>
#include <cstdio>
#include <sdf/sdf.hh>

int main(int, char **argv) {
  sdf::Root root;
  const auto errors = root.Load(argv[1]);
  for (const auto &error : errors) std::fprintf(stderr, "%s\n", error.Message().c_str());
  const auto *model = root.Model();
  if (!errors.empty() || !model) return 1;
  for (uint64_t i = 0; i < model->LinkCount(); ++i) {
    const auto *link = model->LinkByIndex(i);
    const auto &inertial = link->Inertial();
    const auto at = inertial.Pose().Pos();
    const auto m = inertial.Moi();
    std::printf("%s\t%.17g\t%.17g %.17g %.17g\t%d\t", link->Name().c_str(), inertial.MassMatrix().Mass(), at.X(), at.Y(),
                at.Z(), int(inertial.MassMatrix().IsValid()));
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) std::printf("%.17g ", m(r, c));
    std::printf("\n");
  }
}
