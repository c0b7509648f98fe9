/* The formats of motions, and what the header of one says. */
#ifndef SOLVER_MOTION_INFO_H
#define SOLVER_MOTION_INFO_H

#include <stdint.h>

enum motion_format { MOTION_SNIFF, MOTION_PC2, MOTION_MDD, MOTION_OBJ_TAR, MOTION_PACKED };

struct motion_info {
	enum motion_format format;
	uint32_t
		frame_count; /* 0 where that is known only once the end was read: an OBJ sequence, or packed from one */
	uint32_t vertex_count;    /* points of a frame */
	double frames_per_second; /* MDD by its times; PC2 and OBJ have none: 30 over the frames per sample */
	double start_frame;       /* PC2; else 0 */
};

#endif
