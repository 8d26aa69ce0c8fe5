"""ROS 2 messages as values, without ROS: CDR bytes in and out, keys' companions, markers.

Pure but for the library that knows the types (rosbags, the extra ``[ros2]``), which is only
loaded where ROS 2 is spoken. Nothing here knows of a network or a clock.
"""
