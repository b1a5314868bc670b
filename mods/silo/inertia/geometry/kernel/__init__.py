# SPDX-License-Identifier: LGPL-2.1-or-later
"""OpenCASCADE through OCP: nothing of it is imported before this package has said what is wrong with it."""

from silo.bom.errors import ConfigError

try:
    import OCP
    import OCP.BRep  # whose libraries are loaded here
except ImportError as error:
    if "cannot open shared object file" in str(error):
        raise ConfigError(
            f"the geometry kernel lacks a library of the system ({error}). "
            "On Debian and Ubuntu: apt-get install libgl1"
        ) from error
    if not isinstance(error, ModuleNotFoundError):  # as where a limit of memory leaves no room for it
        raise
    raise ConfigError(
        "STEP files and FreeCAD shapes need the geometry kernel, which is not installed: "
        'pip install "silo-mod[inertia]"'
    ) from error

if int(OCP.__version__.split(".")[0]) < 8:
    raise ConfigError(
        f"the geometry kernel OCP {OCP.__version__} loses placements that scale or mirror; wanted version 8: "
        'pip install "silo-mod[inertia]"'
    )
