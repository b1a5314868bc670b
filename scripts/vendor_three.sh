#!/usr/bin/env bash
# Makes mods/silo/viewer/three.min.js anew from the npm package: what the viewer uses, in one file.
# Needs node and npm. Change the versions here, run, look at a report and a product in a browser, commit.
set -euo pipefail
THREE=0.187.0 ESBUILD=0.28.2
here=$(cd "$(dirname "$0")/.." && pwd)
viewer=$here/mods/silo/viewer
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --no-audit --no-fund --silent "three@$THREE" "esbuild@$ESBUILD"
cat >entry.js <<'JS'
export {
  Box3, BufferGeometry, Color, DirectionalLight, DoubleSide, EdgesGeometry, Float32BufferAttribute, Frustum, GreaterDepth,
  HemisphereLight, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshLambertMaterial, PerspectiveCamera, Plane,
  Raycaster, Scene, Sphere, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
export { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
JS
npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020 \
  --banner:js="/* three.js $THREE, MIT License, see three.LICENSE.txt; made by scripts/vendor_three.sh */" \
  --outfile="$viewer/three.min.js"
cp node_modules/three/LICENSE "$viewer/three.LICENSE.txt"
