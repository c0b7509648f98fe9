/* Files of a layout that are made when somebody first asks for them (drawing_list.h). */
#ifndef API_DRAWING_H
#define API_DRAWING_H

#include "api/content.h"

/* GET of a file that the store does not have (content_missing): a job makes it, and the connection is held meanwhile,
 * for as long as `Prefer: wait` says or else as the service allows. What then is not there is the problem of its job,
 * or "drawing-queued". With `Prefer: respond-async` the answer is 202 with the job. */
content_missing drawing_respond;

#endif
