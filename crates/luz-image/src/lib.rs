//! Float images, their file formats, tone mapping and image metrics.
