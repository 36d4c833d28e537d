"""Pages and pictures: blocks of text, tables and figures, as HTML, SVG and PNG."""
