#include "storage/resource.h"

#include <stdlib.h>
#include <string.h>

void resource_clear(struct resource *resource)
{
	free(resource->name);
	free(resource->options);
	free(resource->summary);
	job_clear(&resource->job);
	resource->name = resource->options = resource->summary = NULL;
}

void resource_page_clear(struct resource_page *page)
{
	for (size_t i = 0; i < page->count; i++)
		resource_clear(&page->resources[i]);
	free(page->resources);
	memset(page, 0, sizeof *page);
}
