#!/usr/bin/env bash
# Builds fmnet-train for NVIDIA GPUs with NVIDIA's compiler from PyPI: no CUDA toolkit and no GPU are needed to build.
# Usage: trainer/build-cuda.sh [compute capability, 90 by default: 80 for an A100, 86 or 89 for consumer cards, 90 for an H100]
# The program is target/cuda/release/fmnet-train; run it with LD_LIBRARY_PATH as printed at the end.
set -euo pipefail
cd "$(dirname "$0")/.."
export CUDA_COMPUTE_CAP=${1:-90} CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target/cuda}
environment=$CARGO_TARGET_DIR/nvidia

python3 -m venv "$environment"
"$environment/bin/pip" install --quiet "nvidia-cuda-nvcc==13.0.*" "nvidia-nvvm==13.0.*" "nvidia-cuda-crt==13.0.*" \
  "nvidia-cuda-runtime==13.0.*" "nvidia-cuda-cccl==13.0.*" "nvidia-cuda-nvrtc==13.0.*" "nvidia-cublas==13.0.*" \
  "nvidia-curand==10.4.*"
CUDA_HOME=$("$environment/bin/python" -c 'import nvidia; print(list(nvidia.__path__)[0])')/cu13
export CUDA_HOME CUDA_PATH=$CUDA_HOME CUDA_ROOT=$CUDA_HOME CUDA_TOOLKIT_ROOT_DIR=$CUDA_HOME PATH="$CUDA_HOME/bin:$PATH"

# The packages name their libraries with versions only; the linker looks for plain names.
for library in "$CUDA_HOME"/lib/lib*.so.*; do
  plain=${library%%.so.*}.so
  [ -e "$plain" ] || ln -s "$(basename "$library")" "$plain"
done
# The driver's library comes with the driver. To link without one, a library that has its functions, empty, stands in.
if ! ldconfig -p | grep -q 'libcuda\.so '; then
  cargo fetch --quiet
  bindings=("${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/cudarc-*/src/driver/sys/mod.rs)
  grep -ohE '\bcu[A-Z][A-Za-z0-9_]*' "${bindings[@]}" | sort -u | sed 's/.*/void &(void) {}/' |
    cc -x c -shared -fPIC -Wl,-soname,libcuda.so.1 -o "$CUDA_HOME/lib/libcuda.so" -
fi

cargo build --release -p fmnet-trainer --features cuda --bin fmnet-train
echo "LD_LIBRARY_PATH=$CUDA_HOME/lib $CARGO_TARGET_DIR/release/fmnet-train train --cuda ..."
