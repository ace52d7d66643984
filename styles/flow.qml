<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<!-- Upstream area, from pale to dark blue. The values here suit square metres; the tools spread the
     ramp over the range of the layer. -->
<qgis version="3.22.0" styleCategories="Symbology">
  <pipe>
    <provider>
      <resampling enabled="true" zoomedInResamplingMethod="nearestNeighbour" zoomedOutResamplingMethod="average" maxOversampling="16"/>
    </provider>
    <rasterrenderer type="singlebandpseudocolor" band="1" opacity="1" alphaBand="-1" nodataColor="" classificationMin="100" classificationMax="10000000000">
      <rasterTransparency/>
      <minMaxOrigin>
        <limits>None</limits>
        <extent>WholeRaster</extent>
        <statAccuracy>Estimated</statAccuracy>
      </minMaxOrigin>
      <rastershader>
        <colorrampshader colorRampType="INTERPOLATED" classificationMode="1" clip="0" minimumValue="100" maximumValue="10000000000" labelPrecision="0">
          <colorramp type="gradient" name="[source]">
            <Option type="Map">
              <Option type="QString" name="color1" value="247,251,255,255"/>
              <Option type="QString" name="color2" value="8,48,107,255"/>
              <Option type="QString" name="discrete" value="0"/>
              <Option type="QString" name="rampType" value="gradient"/>
              <Option type="QString" name="stops" value="0.25;198,219,239,255:0.5;107,174,214,255:0.75;33,113,181,255"/>
            </Option>
          </colorramp>
          <item value="100" label="100" color="#f7fbff" alpha="255"/>
          <item value="1000" label="1 000" color="#deebf7" alpha="255"/>
          <item value="10000" label="10 000" color="#c6dbef" alpha="255"/>
          <item value="100000" label="100 000" color="#98c4e2" alpha="255"/>
          <item value="1000000" label="1 000 000" color="#6baed6" alpha="255"/>
          <item value="10000000" label="10 000 000" color="#4690c6" alpha="255"/>
          <item value="100000000" label="100 000 000" color="#2171b5" alpha="255"/>
          <item value="1000000000" label="1 000 000 000" color="#145090" alpha="255"/>
          <item value="10000000000" label="10 000 000 000" color="#08306b" alpha="255"/>
        </colorrampshader>
      </rastershader>
    </rasterrenderer>
    <brightnesscontrast brightness="0" contrast="0" gamma="1"/>
    <huesaturation saturation="0" grayscaleMode="0" colorizeOn="0"/>
    <rasterresampler maxOversampling="2"/>
    <resamplingStage>provider</resamplingStage>
  </pipe>
  <blendMode>0</blendMode>
</qgis>
