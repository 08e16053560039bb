"""ROS 2 nodes of rhythmid: plant, excitation, delay_injector, recorder. No physics and no estimator live here."""
