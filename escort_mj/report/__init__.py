"""Pictures of a run, from its folder alone: `figures.draw_figures` and `video.render_video`."""
