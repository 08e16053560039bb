"""ROS 2 nodes of rhythmid: plant, excitation, delay_injector, recorder. They contain no physics and no estimator."""
