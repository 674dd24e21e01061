# Environment of every task; edit freely, `tofgraph batch` does not overwrite this file.
#
# Modules:            module load gcc openmpi
# Account and queue:  SBATCH_OPTIONS="--account=lab --partition=short"
# Scratch folder:     export TMPDIR=/scratch/$USER
# More time:          REDUCE_TIME=02:00:00; REDUCE_MEMORY=4G; DIAGNOSE_TIME=12:00:00; DIAGNOSE_MEMORY=16G
