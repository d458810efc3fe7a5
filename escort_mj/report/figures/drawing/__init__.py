"""What all figures share: style, letters, formats, scales, and curves that stay readable."""
