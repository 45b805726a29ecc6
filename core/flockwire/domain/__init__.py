"""What every other module uses: vectors, bodies, motion, time. Nothing here imports anything of flockwire's."""
