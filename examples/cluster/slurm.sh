#!/bin/sh
# Flies a sweep as a job array of Slurm, one shard for each task:
#
#   sbatch --array=1-16 examples/cluster/slurm.sh delay-loss /shared/delay-loss
#   ringwing sweep merge /shared/delay-loss          # when all tasks have ended
#
# A task that is killed loses only the flights in the air: submit the same array again, and it goes on.
#SBATCH --job-name=ringwing-sweep
#SBATCH --cpus-per-task=2
#SBATCH --time=01:00:00
#SBATCH --requeue
set -eu

sweep=${1:?give a sweep: a name or a file}
out=${2:?give a folder that all nodes share}

# The shard comes from SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT.
exec "${RINGWING:-ringwing}" sweep "$sweep" --out "$out" --jobs "${SLURM_CPUS_PER_TASK:-1}"
