"""The page of the workbench: a run seen and touched in a browser. Bokeh draws; knows no ROS."""
