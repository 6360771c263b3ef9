#!/bin/sh
# A campaign as a job array of Slurm: one task a chunk.
#
#     flight sweep cubli_seeds --runs 10000 --out /shared/study --plan      # says how many chunks there are: 0 to N
#     sbatch --array=0-49 examples/campaigns/slurm.sh /shared/study
#     flight sweep /shared/study --resume                                   # what is missing, and the table
#
# The folder lies where all nodes see it. A task that is repeated finds its chunk there and ends.
#SBATCH --job-name=campaign
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --time=01:00:00
#SBATCH --requeue

exec flight sweep "$1" --chunk "$SLURM_ARRAY_TASK_ID" --resume
